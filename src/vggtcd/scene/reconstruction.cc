// SPDX-License-Identifier: Apache-2.0
// Reconstruction: frames by name, and the promise of its sizes.
#include "vggtcd/scene/reconstruction.h"

#include <algorithm>

#include "vggtcd/core/error.h"
#include "vggtcd/core/number_text.h"

namespace vggtcd {
namespace {

// [S, per_frame] without the frames that leave.
template <typename T>
void compact(const std::vector<bool>& remove, size_t per_frame, std::vector<T>& values) {
  const auto start_of = [&](size_t frame) {
    return values.begin() + static_cast<std::ptrdiff_t>(frame * per_frame);
  };
  size_t to = 0;
  for (size_t frame = 0; frame < remove.size(); ++frame) {
    if (remove[frame]) continue;
    if (to != frame) std::move(start_of(frame), start_of(frame + 1), start_of(to));
    ++to;
  }
  values.erase(start_of(to), values.end());
}

}  // namespace

std::optional<int> find_frame(const Reconstruction& reconstruction, std::string_view photo) {
  for (int frame = 0; frame < reconstruction.num_frames(); ++frame) {
    if (reconstruction.views[static_cast<size_t>(frame)].name == photo) return frame;
  }
  const auto number = number_in<int>(photo);
  return number ? reconstruction.frame_of_number(*number) : std::nullopt;
}

std::optional<int> Reconstruction::frame_of_number(int number_in_file) const {
  if (number_in_file < 0 || number_in_file >= frames_in_file()) return {};
  const auto at = std::ranges::lower_bound(left_out, number_in_file);
  if (at != left_out.end() && *at == number_in_file) return {};
  return number_in_file - static_cast<int>(at - left_out.begin());
}

int Reconstruction::number_of_frame(int frame) const {
  int number = frame;
  for (const int missing : left_out) number += missing <= number ? 1 : 0;
  return number;
}

void remove_frames(Reconstruction& reconstruction, const std::vector<bool>& remove) {
  check(remove.size() == reconstruction.views.size() && reconstruction.left_out.empty(),
        "remove_frames: an answer for every frame of the file");
  const size_t pixels = reconstruction.pixels_per_frame();
  compact(remove, 1, reconstruction.views);
  compact(remove, pixels, reconstruction.depth);
  compact(remove, pixels, reconstruction.confidence);
  compact(remove, 3 * pixels, reconstruction.color);
  if (!reconstruction.sky.empty()) compact(remove, pixels, reconstruction.sky);
  for (size_t frame = 0; frame < remove.size(); ++frame) {
    if (remove[frame]) reconstruction.left_out.push_back(static_cast<int>(frame));
  }
}

void check_consistent(const Reconstruction& r) {
  check(r.height > 0 && r.width > 0, "reconstruction: positive frame size");
  check(r.depth.size() == r.num_pixels(), "reconstruction: depth is [S, H, W]");
  check(r.confidence.size() == r.num_pixels(), "reconstruction: confidence is [S, H, W]");
  check(r.color.size() == 3 * r.num_pixels(), "reconstruction: color is [S, H, W, 3]");
  check(r.sky.empty() || r.sky.size() == r.num_pixels(), "reconstruction: sky is [S, H, W]");
  for (const View& view : r.views) {
    check(view.pinhole.width == r.width && view.pinhole.height == r.height,
          "reconstruction: every view has the frame size");
  }
}

}  // namespace vggtcd
