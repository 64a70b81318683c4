// SPDX-License-Identifier: Apache-2.0
// The two embeddings of position that are added to features: the ViT's learned grid, resampled, and
// the DPT head's waves.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace vggtcd {

// The learned grid [side, side, channels] resampled to [height, width, channels]: separable bicubic
// interpolation, a = -0.5, half-pixel centres, the kernel stretched when shrinking, windows clipped
// and renormalised at the borders. (interpolate_pos_encoding with antialias=True)
std::vector<float> resample_position_grid(std::span<const float> grid, int64_t side,
                                          int64_t channels, int64_t height, int64_t width);

// ratio * [sin, cos of x; sin, cos of y] of the cells of a feature map, separable: cell (y, x) has
// x_waves[x] followed by y_waves[y], each of channels / 2. x spans +-W / diagonal * (w - 1) / w of
// the photo, y likewise; frequencies 100^(-k / (channels / 4)). (_apply_pos_embed, ratio 0.1)
struct DptPositions {
  DptPositions(int64_t height, int64_t width, int64_t channels, int64_t image_height,
               int64_t image_width);
  // features [count, channels] of cells first, first + 1, .. in row-major order: adds the waves.
  void add(int64_t first, int64_t count, float* features, int64_t stride) const;

  int64_t width, channels;
  std::vector<float> x_waves;  // [width, channels / 2]
  std::vector<float> y_waves;  // [height, channels / 2]
};

}  // namespace vggtcd
