// SPDX-License-Identifier: Apache-2.0
// PhotoTallies: the fused votes about the pixels of one photo.
#include "vggtcd/change/photo_tallies.h"

#include <algorithm>
#include <cmath>

namespace vggtcd {
namespace {

constexpr float kSameSurface = 0.03f;  // relative depth step within a surface around a pixel
constexpr int kSmoothReference = 260;  // width that a radius is in pixels of

}  // namespace

PhotoTallies::PhotoTallies(const Inquiry& inquiry, int frame, const VoteGrid& grid,
                           const VoteScale& scale)
    : width_(inquiry.judged().width),
      height_(inquiry.judged().height),
      depth_(inquiry.judged().frame_depth(frame)),
      tallies_(inquiry.judged().pixels_per_frame()) {
  const size_t first = static_cast<size_t>(frame) * tallies_.size();
  inquiry.for_each_point(frame, 1, [&](size_t pixel, const Eigen::Vector3f& x) {
    tallies_[pixel - first] = Tally(grid.at(x), scale);
  });
}

Tally PhotoTallies::around(int u, int v, int radius) const {
  const int step = std::max(1, (width_ + kSmoothReference / 2) / kSmoothReference);
  const float depth = depth_[index(u, v)];
  Tally sum;
  for (int y = v - radius * step; y <= v + radius * step; y += step) {
    if (y < 0 || y >= height_) continue;
    for (int x = u - radius * step; x <= u + radius * step; x += step) {
      if (x < 0 || x >= width_ || !asked(x, y)) continue;
      if (std::abs(depth_[index(x, y)] - depth) > kSameSurface * depth) continue;
      sum += tallies_[index(x, y)];
    }
  }
  return sum;
}

}  // namespace vggtcd
