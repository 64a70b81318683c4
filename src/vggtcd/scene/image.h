// SPDX-License-Identifier: Apache-2.0
// Image: 8-bit RGB pixels, interleaved, rows from the top.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace vggtcd {

struct Image {
  int width = 0, height = 0;
  std::vector<uint8_t> rgb;  // [height, width, 3]

  Image() = default;
  Image(int width_px, int height_px)
      : width(width_px),
        height(height_px),
        rgb(static_cast<size_t>(width_px) * static_cast<size_t>(height_px) * 3) {}

  uint8_t* pixel(int x, int y) { return rgb.data() + offset(x, y); }
  const uint8_t* pixel(int x, int y) const { return rgb.data() + offset(x, y); }

 private:
  size_t offset(int x, int y) const {
    return (static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)) * 3;
  }
};

}  // namespace vggtcd
