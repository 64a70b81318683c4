// SPDX-License-Identifier: Apache-2.0
// Element-wise steps between the products: GELU, SiLU, the residual with layer scale, conversion
// between f32 and bfloat16.
#pragma once

#include <cstdint>

namespace vggtcd {

// y = x * Phi(x), Phi the normal distribution function: the exact GELU, not the tanh approximation.
// In place (y == x) allowed where the types agree. Error: 2e-7 (|x| + |y|), and the rounding to
// bf16.
void gelu_f32(int64_t size, const float* x, float* y);
void gelu_bf16(int64_t size, const uint16_t* x, uint16_t* y);
void gelu_f32_to_bf16(int64_t size, const float* x, uint16_t* y);

// y = x / (1 + exp(-x)); in place allowed. Relative error 5e-7.
void silu_f32(int64_t size, const float* x, float* y);

// x += gamma * y, the residual of a block with layer scale: x [rows, channels] and y
// [rows, channels] dense; gamma [channels], null for 1.
void add_scaled_f32(int64_t rows, int64_t channels, float* x, const float* gamma, const float* y);
void add_scaled_bf16(int64_t rows, int64_t channels, float* x, const float* gamma,
                     const uint16_t* y);

// Rounding to nearest, ties to even; NaN stays NaN. The way back is exact.
void bf16_from_f32(int64_t size, const float* x, uint16_t* y);
void f32_from_bf16(int64_t size, const uint16_t* x, float* y);

}  // namespace vggtcd
