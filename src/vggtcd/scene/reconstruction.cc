// SPDX-License-Identifier: Apache-2.0
// Reconstruction: frames by name, and the promise of its sizes.
#include "vggtcd/scene/reconstruction.h"

#include "vggtcd/core/error.h"
#include "vggtcd/core/number_text.h"

namespace vggtcd {

std::optional<int> find_frame(const Reconstruction& reconstruction, std::string_view photo) {
  for (int frame = 0; frame < reconstruction.num_frames(); ++frame) {
    if (reconstruction.views[static_cast<size_t>(frame)].name == photo) return frame;
  }
  const auto number = number_in<int>(photo);
  if (number && *number >= 0 && *number < reconstruction.num_frames()) return number;
  return {};
}

void check_consistent(const Reconstruction& r) {
  check(r.height > 0 && r.width > 0, "reconstruction: positive frame size");
  check(r.depth.size() == r.num_pixels(), "reconstruction: depth is [S, H, W]");
  check(r.confidence.size() == r.num_pixels(), "reconstruction: confidence is [S, H, W]");
  check(r.color.size() == 3 * r.num_pixels(), "reconstruction: color is [S, H, W, 3]");
  for (const View& view : r.views) {
    check(view.pinhole.width == r.width && view.pinhole.height == r.height,
          "reconstruction: every view has the frame size");
  }
}

}  // namespace vggtcd
