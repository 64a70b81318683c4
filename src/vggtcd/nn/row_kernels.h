// SPDX-License-Identifier: Apache-2.0
// The vector code behind layer_norm.h, qk_norm_rope.h, activation.h and resize.h: one table of
// functions for every instruction set. All run on the calling thread; in place where the header of
// the operation says so.
#pragma once

#include <cstdint>

namespace vggtcd {

// One LayerNorm over channels elements; weight and bias null for 1 and 0.
struct RowNorm {
  int64_t channels;
  const float* weight;
  const float* bias;
  float eps;
};

// Normalisation (if weight) and rotation (if cosines) of the heads of one row; cosines_y ..
// sines_x: [head_dim / 4] each, of the row's position.
struct HeadsNormRope {
  int64_t heads;
  int64_t head_dim;  // a multiple of kRopeMultiple, at most kRopeLargestHead
  const float* weight;
  const float* bias;
  float eps;
  const float *cosines_y, *sines_y, *cosines_x, *sines_x;
};
constexpr int64_t kRopeMultiple = 64;
constexpr int64_t kRopeLargestHead = 128;

struct RowKernels {
  void (*layer_norm_f32)(const RowNorm& norm, const float* x, float* y);
  void (*layer_norm_bf16)(const RowNorm& norm, const float* x, uint16_t* y);
  void (*norm_rope_f32)(const HeadsNormRope& op, float* row);
  void (*norm_rope_bf16)(const HeadsNormRope& op, uint16_t* row);
  void (*gelu_f32)(int64_t size, const float* x, float* y);
  void (*gelu_bf16)(int64_t size, const uint16_t* x, uint16_t* y);
  void (*gelu_f32_to_bf16)(int64_t size, const float* x, uint16_t* y);
  void (*silu_f32)(int64_t size, const float* x, float* y);
  void (*bf16_from_f32)(int64_t size, const float* x, uint16_t* y);
  void (*f32_from_bf16)(int64_t size, const uint16_t* x, float* y);
  // x += gamma * y over one row; gamma null for 1.
  void (*add_scaled_f32)(int64_t channels, float* x, const float* gamma, const float* y);
  void (*add_scaled_bf16)(int64_t channels, float* x, const float* gamma, const uint16_t* y);
  // y = x0 + weight * (x1 - x0), + add if not null.
  void (*lerp)(int64_t size, const float* x0, const float* x1, float weight, const float* add,
               float* y);
};

const RowKernels& row_kernels_avx2();
const RowKernels& row_kernels_avx512();

// Those of cpu_level(); null at CpuLevel::kReference.
const RowKernels* row_kernels();

}  // namespace vggtcd
