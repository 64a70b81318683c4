// SPDX-License-Identifier: Apache-2.0
// Eight floats in AVX2 and FMA, under the names that the kernels use (simd_avx512.h has sixteen
// under the same names). For files compiled for this instruction set only: everything has internal
// linkage.
#pragma once

#include <cstdint>

#include "vggtcd/core/intrinsics.h"

namespace vggtcd {
namespace {

struct Avx2 {
  using V = __m256;
  static constexpr int kLanes = 8;
  static constexpr int kAccumulatorRows = 4;  // x 3 columns of accumulators, of 16 registers

  static V zero() { return _mm256_setzero_ps(); }
  static V set(float value) { return _mm256_set1_ps(value); }
  static V load(const float* p) { return _mm256_loadu_ps(p); }
  static void store(float* p, V a) { _mm256_storeu_ps(p, a); }
  static V add(V a, V b) { return _mm256_add_ps(a, b); }
  static V sub(V a, V b) { return _mm256_sub_ps(a, b); }
  static V mul(V a, V b) { return _mm256_mul_ps(a, b); }
  static V div(V a, V b) { return _mm256_div_ps(a, b); }
  static V fma(V a, V b, V c) { return _mm256_fmadd_ps(a, b, c); }    // a * b + c
  static V fnma(V a, V b, V c) { return _mm256_fnmadd_ps(a, b, c); }  // c - a * b
  static V max(V a, V b) { return _mm256_max_ps(a, b); }              // b where either is NaN
  static V min(V a, V b) { return _mm256_min_ps(a, b); }              // b where either is NaN
  static V sqrt(V a) { return _mm256_sqrt_ps(a); }
  static V abs(V a) { return _mm256_andnot_ps(_mm256_set1_ps(-0.0f), a); }
  static V round(V a) { return _mm256_round_ps(a, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC); }
  static V ceil(V a) { return _mm256_round_ps(a, _MM_FROUND_TO_POS_INF | _MM_FROUND_NO_EXC); }
  // a * 2^n for integral n <= 127; 0 for n <= -127.
  static V scale_by_power_of_2(V a, V n) {
    const __m256i exponent = _mm256_cvtps_epi32(_mm256_max_ps(_mm256_set1_ps(-127.0f), n));
    const __m256i biased = _mm256_add_epi32(exponent, _mm256_set1_epi32(127));
    return _mm256_mul_ps(a, _mm256_castsi256_ps(_mm256_slli_epi32(biased, 23)));
  }
  static bool any_greater(V a, V b) {
    return _mm256_movemask_ps(_mm256_cmp_ps(a, b, _CMP_GT_OQ)) != 0;
  }
  // a > b ? x : y
  static V select_greater(V a, V b, V x, V y) {
    return _mm256_blendv_ps(y, x, _mm256_cmp_ps(a, b, _CMP_GT_OQ));
  }
  // Of the first n floats (0 <= n <= kLanes); the others read as 0, and are not written.
  static V load_first(const float* p, int64_t n) { return _mm256_maskload_ps(p, first(n)); }
  static void store_first(float* p, V a, int64_t n) { _mm256_maskstore_ps(p, first(n), a); }
  static V keep_first(V a, int64_t n) { return _mm256_and_ps(a, _mm256_castsi256_ps(first(n))); }
  // The same from and to bfloat16: exact, and rounded to nearest even with NaN kept.
  static V load_bf16(const uint16_t* p) {
    return widen(_mm_loadu_si128(reinterpret_cast<const __m128i*>(p)));
  }
  static V load_first_bf16(const uint16_t* p, int64_t n) {
    alignas(16) uint16_t buffer[kLanes] = {};
    for (int64_t i = 0; i < n; ++i) buffer[i] = p[i];
    return load_bf16(buffer);
  }
  static void store_bf16(uint16_t* p, V a) {
    _mm_storeu_si128(reinterpret_cast<__m128i*>(p), narrow(a));
  }
  static void store_first_bf16(uint16_t* p, V a, int64_t n) {
    alignas(16) uint16_t buffer[kLanes];
    store_bf16(buffer, a);
    for (int64_t i = 0; i < n; ++i) p[i] = buffer[i];
  }
  // 32-bit words at p + index.
  using Index = __m256i;
  static Index load_index(const int32_t* p) {
    return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p));
  }
  static V gather(const float* p, Index index) { return _mm256_i32gather_ps(p, index, 4); }
  // The two bfloat16 in each word: the one at the lower address, the one at the higher.
  static V low_bf16(V words) {
    return _mm256_castsi256_ps(_mm256_slli_epi32(_mm256_castps_si256(words), 16));
  }
  static V high_bf16(V words) {
    return _mm256_castsi256_ps(
        _mm256_and_si256(_mm256_castps_si256(words), _mm256_set1_epi32(-65536)));
  }
  static float sum(V a) {
    const __m128 four = _mm_add_ps(_mm256_castps256_ps128(a), _mm256_extractf128_ps(a, 1));
    const __m128 two = _mm_add_ps(four, _mm_movehl_ps(four, four));
    return _mm_cvtss_f32(_mm_add_ss(two, _mm_movehdup_ps(two)));
  }

 private:
  static __m256i first(int64_t n) {
    const __m256i lane = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    return _mm256_cmpgt_epi32(_mm256_set1_epi32(static_cast<int32_t>(n)), lane);
  }
  static V widen(__m128i a) {
    return _mm256_castsi256_ps(_mm256_slli_epi32(_mm256_cvtepu16_epi32(a), 16));
  }
  static __m128i narrow(V a) {
    const __m256i bits = _mm256_castps_si256(a);
    const __m256i odd = _mm256_and_si256(_mm256_srli_epi32(bits, 16), _mm256_set1_epi32(1));
    const __m256i rounded =
        _mm256_add_epi32(bits, _mm256_add_epi32(odd, _mm256_set1_epi32(0x7fff)));
    const __m256i quiet = _mm256_or_si256(bits, _mm256_set1_epi32(0x400000));
    const __m256 nan = _mm256_cmp_ps(a, a, _CMP_UNORD_Q);
    const __m256i kept = _mm256_castps_si256(
        _mm256_blendv_ps(_mm256_castsi256_ps(rounded), _mm256_castsi256_ps(quiet), nan));
    const __m256i words = _mm256_srli_epi32(kept, 16);
    return _mm_packus_epi32(_mm256_castsi256_si128(words), _mm256_extracti128_si256(words, 1));
  }
};

}  // namespace
}  // namespace vggtcd
