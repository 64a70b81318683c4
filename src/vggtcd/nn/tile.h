// SPDX-License-Identifier: Apache-2.0
// The micro-kernel of every product here: a tile of rows times three vectors of columns, held in
// registers over many steps. Internal linkage: every instruction set has its own.
#pragma once

#include <cstdint>

#include "vggtcd/nn/simd_math.h"

namespace vggtcd {
namespace {

// A vector type whose lanes multiply single f32 words.
template <typename Simd>
struct F32Words : Simd {
  using V = typename Simd::V;
  static constexpr int kPerWord = 1;
  static V dot(V acc, V a, V b) { return Simd::fma(a, b, acc); }
  // The bound keeps minus infinity, a score that overflowed, from becoming NaN.
  static V exp2(V x) { return exp2_f32<Simd>(Simd::max(Simd::set(-1000.0f), x)); }
};

// acc[row][column] = sum over steps of words[row * row_stride + step * step_stride] (a word, on all
// lanes) times the vector vectors[step, column]. Strides that are constants stay constants.
template <typename S, int kRows, int kColumns>
[[gnu::always_inline]] inline void multiply_tile(int64_t steps, const float* words,
                                                 int64_t row_stride, int64_t step_stride,
                                                 const float* vectors,
                                                 typename S::V (&acc)[kRows][kColumns]) {
  using V = typename S::V;
  for (int r = 0; r < kRows; ++r) {
    for (int c = 0; c < kColumns; ++c) acc[r][c] = S::zero();
  }
  for (int64_t step = 0; step < steps; ++step) {
    V v[kColumns];
    for (int c = 0; c < kColumns; ++c) v[c] = S::load(vectors + c * S::kLanes);
    for (int r = 0; r < kRows; ++r) {
      const V word = S::set(words[r * row_stride]);
      for (int c = 0; c < kColumns; ++c) acc[r][c] = S::dot(acc[r][c], v[c], word);
    }
    words += step_stride;
    vectors += kColumns * S::kLanes;
  }
}

}  // namespace
}  // namespace vggtcd
