// SPDX-License-Identifier: Apache-2.0
// Which photos of the other epoch look at what a photo shows.
#pragma once

#include <vector>

#include "vggtcd/geometry/sim3.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

// For each view of `from` the views of `to` that overlap it most, at most max_views, best first.
// Overlap is the number of sample points of the photo that fall into the other one, each weighted
// by the cosine between the two viewing rays; views without any are left out. to_from_from maps
// `from`'s world to `to`'s.
std::vector<std::vector<int>> overlapping_views(const Reconstruction& from,
                                                const Reconstruction& to, const Sim3& to_from_from,
                                                int max_views);

}  // namespace vggtcd
