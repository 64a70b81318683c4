// SPDX-License-Identifier: Apache-2.0
// How many pixels of a mask lie in the square around a pixel, at the same cost for any size.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace vggtcd {

// A table of sums over a mask of [H, W]; squares are cut off at the border of the photo.
class PixelCounts {
 public:
  // Not 0: counts.
  PixelCounts(std::span<const uint8_t> mask, int width, int height)
      : width_(width), height_(height), sums_(row(height + 1)) {
    for (int v = 0; v < height; ++v) {
      int in_row = 0;
      for (int u = 0; u < width; ++u) {
        in_row +=
            mask[static_cast<size_t>(v) * static_cast<size_t>(width) + static_cast<size_t>(u)] != 0;
        sums_[at(u + 1, v + 1)] = sums_[at(u + 1, v)] + in_row;
      }
    }
  }

  // Of the square from -radius to +radius around a pixel.
  double share_around(size_t pixel, int radius) const {
    const Square s = square(pixel, radius);
    return static_cast<double>(s.count) / static_cast<double>(s.size);
  }
  bool all_around(size_t pixel, int radius) const {
    const Square s = square(pixel, radius);
    return s.count == s.size;
  }

 private:
  struct Square {
    int count, size;
  };
  Square square(size_t pixel, int radius) const {
    const int u = static_cast<int>(pixel % static_cast<size_t>(width_));
    const int v = static_cast<int>(pixel / static_cast<size_t>(width_));
    const int left = std::max(0, u - radius), right = std::min(width_, u + radius + 1);
    const int top = std::max(0, v - radius), bottom = std::min(height_, v + radius + 1);
    return {sums_[at(right, bottom)] - sums_[at(left, bottom)] - sums_[at(right, top)] +
                sums_[at(left, top)],
            (right - left) * (bottom - top)};
  }
  size_t row(int v) const { return static_cast<size_t>(v) * static_cast<size_t>(width_ + 1); }
  size_t at(int u, int v) const { return row(v) + static_cast<size_t>(u); }

  int width_, height_;
  std::vector<int> sums_;  // [H + 1, W + 1]
};

}  // namespace vggtcd
