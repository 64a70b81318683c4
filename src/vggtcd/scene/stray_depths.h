// SPDX-License-Identifier: Apache-2.0
// Depths so far from all others that they are no surface of the scene: one such pixel (a network's
// sky without a mask) must not decide anything.
#pragma once

#include <cstddef>

#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

struct StrayDepths {
  size_t too_near = 0, too_far = 0;  // pixels that were dropped
  double nearest = 0, farthest = 0;  // the ordinary range: 1st and 99th percentile of all depths

  size_t count() const { return too_near + too_far; }
};

// Sets depths to 0 (no depth) that are more than 100 times the 99th percentile of all depths of the
// reconstruction or less than a hundredth of the 1st; and at 5 times already where a pixel is
// alone, with no depth within a factor of two in the 3 x 3 pixels around it. So fewer than one
// pixel in a hundred can be a stray: where more are that far away, they are a part of the scene.
StrayDepths drop_stray_depths(Reconstruction& reconstruction);

}  // namespace vggtcd
