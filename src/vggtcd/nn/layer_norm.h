// SPDX-License-Identifier: Apache-2.0
// Layer normalisation of rows: y = (x - mean) / sqrt(variance + eps) * weight + bias, variance
// biased (torch.nn.LayerNorm).
#pragma once

#include <cstdint>

namespace vggtcd {

// x [rows, channels], rows x_stride apart; y likewise, in place (y == x) allowed for f32. weight
// and bias [channels], each null for 1 and 0: the affine-free norm. The network mixes eps 1e-5 and
// 1e-6, so there is no default. Two passes in f32: rel L2 error about 2e-7 of y.
void layer_norm_f32(int64_t rows, int64_t channels, const float* x, int64_t x_stride,
                    const float* weight, const float* bias, float eps, float* y, int64_t y_stride);
// The same, rounded to bfloat16.
void layer_norm_bf16(int64_t rows, int64_t channels, const float* x, int64_t x_stride,
                     const float* weight, const float* bias, float eps, uint16_t* y,
                     int64_t y_stride);

}  // namespace vggtcd
