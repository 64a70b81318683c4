// SPDX-License-Identifier: Apache-2.0
// The authors' variant in which all frames of a pass share the first frame's intrinsics.
#include "vggtcd/registration/shared_intrinsics.h"

#include "vggtcd/core/parallel.h"

namespace vggtcd {

void share_intrinsics(Reconstruction& reconstruction) {
  if (reconstruction.views.empty()) return;
  const Pinhole reference = reconstruction.views.front().pinhole;
  const size_t per_frame = reconstruction.pixels_per_frame();
  parallel_for(reconstruction.num_frames(), 1, [&](int64_t frame, int64_t) {
    const size_t index = static_cast<size_t>(frame);
    Pinhole& own = reconstruction.views[index].pinhole;
    const double ratio = 0.5 * (reference.fx / own.fx + reference.fy / own.fy);
    own = reference;
    for (size_t pixel = index * per_frame; pixel < (index + 1) * per_frame; ++pixel) {
      reconstruction.depth[pixel] = static_cast<float>(reconstruction.depth[pixel] * ratio);
    }
  });
}

}  // namespace vggtcd
