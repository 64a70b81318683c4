// SPDX-License-Identifier: Apache-2.0
// The photo of a frame, as the reconstruction keeps it.
#include "vggtcd/scene/frame_image.h"

#include <algorithm>

namespace vggtcd {

Image frame_image(const Reconstruction& reconstruction, int frame) {
  Image image(reconstruction.width, reconstruction.height);
  std::ranges::copy(reconstruction.frame_color(frame), image.rgb.begin());
  return image;
}

}  // namespace vggtcd
