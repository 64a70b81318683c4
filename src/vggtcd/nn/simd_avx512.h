// SPDX-License-Identifier: Apache-2.0
// Sixteen floats in AVX-512 (F, BW, DQ, VL), under the names that the kernels use (simd_avx2.h has
// eight under the same names). For files compiled for this instruction set only: everything has
// internal linkage.
#pragma once

#include <cstdint>

#include "vggtcd/core/intrinsics.h"

namespace vggtcd {
namespace {

struct Avx512 {
  using V = __m512;
  static constexpr int kLanes = 16;
  static constexpr int kAccumulatorRows = 8;  // x 3 columns of accumulators, of 32 registers

  static V zero() { return _mm512_setzero_ps(); }
  static V set(float value) { return _mm512_set1_ps(value); }
  static V load(const float* p) { return _mm512_loadu_ps(p); }
  static void store(float* p, V a) { _mm512_storeu_ps(p, a); }
  static V add(V a, V b) { return _mm512_add_ps(a, b); }
  static V sub(V a, V b) { return _mm512_sub_ps(a, b); }
  static V mul(V a, V b) { return _mm512_mul_ps(a, b); }
  static V div(V a, V b) { return _mm512_div_ps(a, b); }
  static V fma(V a, V b, V c) { return _mm512_fmadd_ps(a, b, c); }    // a * b + c
  static V fnma(V a, V b, V c) { return _mm512_fnmadd_ps(a, b, c); }  // c - a * b
  static V max(V a, V b) { return _mm512_max_ps(a, b); }              // b where either is NaN
  static V min(V a, V b) { return _mm512_min_ps(a, b); }              // b where either is NaN
  static V sqrt(V a) { return _mm512_sqrt_ps(a); }
  static V abs(V a) { return _mm512_abs_ps(a); }
  static V round(V a) {
    return _mm512_roundscale_ps(a, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC);
  }
  static V ceil(V a) { return _mm512_roundscale_ps(a, _MM_FROUND_TO_POS_INF | _MM_FROUND_NO_EXC); }
  // a * 2^n for integral n <= 127; flushes to 0 for n far below.
  static V scale_by_power_of_2(V a, V n) { return _mm512_scalef_ps(a, n); }
  static bool any_greater(V a, V b) { return _mm512_cmp_ps_mask(a, b, _CMP_GT_OQ) != 0; }
  // a > b ? x : y
  static V select_greater(V a, V b, V x, V y) {
    return _mm512_mask_blend_ps(_mm512_cmp_ps_mask(a, b, _CMP_GT_OQ), y, x);
  }
  // Of the first n floats (0 <= n <= kLanes); the others read as 0, and are not written.
  static V load_first(const float* p, int64_t n) { return _mm512_maskz_loadu_ps(first(n), p); }
  static void store_first(float* p, V a, int64_t n) { _mm512_mask_storeu_ps(p, first(n), a); }
  static V keep_first(V a, int64_t n) { return _mm512_maskz_mov_ps(first(n), a); }
  // The same from and to bfloat16: exact, and rounded to nearest even with NaN kept.
  static V load_bf16(const uint16_t* p) {
    return widen(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(p)));
  }
  static V load_first_bf16(const uint16_t* p, int64_t n) {
    return widen(_mm256_maskz_loadu_epi16(first(n), p));
  }
  static void store_bf16(uint16_t* p, V a) {
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(p), narrow(a));
  }
  static void store_first_bf16(uint16_t* p, V a, int64_t n) {
    _mm256_mask_storeu_epi16(p, first(n), narrow(a));
  }
  // 32-bit words at p + index.
  using Index = __m512i;
  static Index load_index(const int32_t* p) { return _mm512_loadu_si512(p); }
  static V gather(const float* p, Index index) { return _mm512_i32gather_ps(index, p, 4); }
  // The two bfloat16 in each word: the one at the lower address, the one at the higher.
  static V low_bf16(V words) {
    return _mm512_castsi512_ps(_mm512_slli_epi32(_mm512_castps_si512(words), 16));
  }
  static V high_bf16(V words) {
    return _mm512_castsi512_ps(
        _mm512_and_si512(_mm512_castps_si512(words), _mm512_set1_epi32(-65536)));
  }
  static float sum(V a) { return _mm512_reduce_add_ps(a); }

 private:
  static __mmask16 first(int64_t n) { return static_cast<__mmask16>((1u << n) - 1u); }
  static V widen(__m256i a) {
    return _mm512_castsi512_ps(_mm512_slli_epi32(_mm512_cvtepu16_epi32(a), 16));
  }
  static __m256i narrow(V a) {
    const __m512i bits = _mm512_castps_si512(a);
    const __m512i odd = _mm512_and_si512(_mm512_srli_epi32(bits, 16), _mm512_set1_epi32(1));
    const __m512i rounded =
        _mm512_add_epi32(bits, _mm512_add_epi32(odd, _mm512_set1_epi32(0x7fff)));
    const __m512i quiet = _mm512_or_si512(bits, _mm512_set1_epi32(0x400000));
    const __mmask16 nan = _mm512_cmp_ps_mask(a, a, _CMP_UNORD_Q);
    return _mm512_cvtepi32_epi16(
        _mm512_srli_epi32(_mm512_mask_blend_epi32(nan, rounded, quiet), 16));
  }
};

}  // namespace
}  // namespace vggtcd
