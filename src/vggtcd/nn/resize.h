// SPDX-License-Identifier: Apache-2.0
// Bilinear resizing with aligned corners (torch interpolate, mode="bilinear", align_corners=True):
// the DPT head's upsampling.
#pragma once

#include <cstdint>

namespace vggtcd {

struct ResizeShape {
  int64_t channels;
  int64_t in_height, in_width;
  int64_t out_height, out_width;
};

// Output row i reads input row i * (in_height - 1) / (out_height - 1) (row 0 if out_height is 1),
// linearly between its two neighbours; columns likewise. Computed in f32, rel max error 1e-6.
// x: channels-last [in_height, in_width, channels], y: [out_height, out_width, channels]; dense.
// With add: y = resize(x) + add, add of y's shape (may be y itself).
void resize_bilinear_channels_last(const ResizeShape& shape, const float* x, float* y,
                                   const float* add = nullptr);
// The same on planes: x [channels, in_height, in_width], y [channels, out_height, out_width].
void resize_bilinear_planar(const ResizeShape& shape, const float* x, float* y,
                            const float* add = nullptr);

}  // namespace vggtcd
