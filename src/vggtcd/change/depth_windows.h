// SPDX-License-Identifier: Apache-2.0
// DepthWindows: the nearest and the farthest depth in the 3 x 3 pixels around each pixel of a
// photo, kept as two places of four bits, because two more depths per pixel would be the largest
// arrays of the whole change stage.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "vggtcd/change/depth_correction.h"

namespace vggtcd {

inline constexpr uint8_t kNoExtremes = 0xff;  // nothing in the window may testify
inline constexpr uint8_t kOpenWindow = 0xfe;  // open sky (scene/sky.h) well around the pixel

// From a pixel to each place of its window, 0 to 8, row by row.
struct WindowSteps {
  std::array<int, 16> to{};  // as many as four bits could name

  explicit WindowSteps(int width) {
    for (int place = 0; place < 9; ++place) {
      to[static_cast<size_t>(place)] = (place / 3 - 1) * width + place % 3 - 1;
    }
  }
};

// Of one photo; refers to arrays that live elsewhere.
struct DepthWindows {
  const float* depth = nullptr;       // [H, W]
  const uint8_t* extremes = nullptr;  // [H, W]: the place of the nearest depth in the low four
                                      // bits, that of the farthest in the high ones; kNoExtremes
                                      // or kOpenWindow
  const WindowSteps* steps = nullptr;
  float scale = 1;  // multiplies depths
  int width = 0;
  PhotoCorrection correction{};

  // Whether the photo looks past everything here.
  bool open(int u, int v) const { return extremes[index(u, v)] == kOpenWindow; }

  // False where no surface in the window may testify.
  bool read(int u, int v, float& near, float& far) const {
    const size_t pixel = index(u, v);
    const uint8_t places = extremes[pixel];
    if (places >= kOpenWindow) return false;
    const float* center = depth + pixel;
    const float factor = scale * correction.nearest(u, v);  // one for the whole window
    near = factor * center[steps->to[places & 15]];
    far = factor * center[steps->to[places >> 4]];
    return true;
  }

 private:
  size_t index(int u, int v) const {
    return static_cast<size_t>(v) * static_cast<size_t>(width) + static_cast<size_t>(u);
  }
};

}  // namespace vggtcd
