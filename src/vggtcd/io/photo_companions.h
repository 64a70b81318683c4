// SPDX-License-Identifier: Apache-2.0
// Pictures in a folder of photos that are no photos of their own: masks, and photos kept twice.
#pragma once

#include <vector>

#include "vggtcd/core/progress.h"
#include "vggtcd/io/photo_source.h"

namespace vggtcd {

// Masks by their names, beside the photo that they belong to: NAME_mask.EXT, NAME-mask.EXT (ODM,
// openMVG), NAME.mask.EXT (OpenMVS), NAME.EXT.EXT (COLMAP); and mask.EXT of openMVG. Leaves them
// out with a notice.
void leave_out_masks(std::vector<PhotoRef>& photos, ProgressSink& progress);

// Photos whose names differ in the extension only and that show the same (decoded and reduced, they
// differ by no more than compression does) count once, the largest of them, or else the first.
// Leaves the others out with a notice; those that show different things stay.
void leave_out_second_formats(std::vector<PhotoRef>& photos, const ImageReadOptions& read,
                              ProgressSink& progress);

}  // namespace vggtcd
