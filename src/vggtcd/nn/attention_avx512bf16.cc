// SPDX-License-Identifier: Apache-2.0
// The attention kernel on AVX-512 with vdpbf16ps: products of bf16 pairs, summed in f32.
#include "vggtcd/nn/attention_kernel_impl.h"
#include "vggtcd/nn/simd_avx512.h"

namespace vggtcd {
namespace {

struct Bf16Words : Avx512 {
  static constexpr int kPerWord = 2;
  static V dot(V acc, V a, V b) {
    return _mm512_dpbf16_ps(acc, reinterpret_cast<__m512bh>(a), reinterpret_cast<__m512bh>(b));
  }
  // 2^x, relative error 8e-5: a fiftieth of the rounding to bfloat16 that follows it. The fraction
  // is x - floor(x); vscalefps takes the floor by itself. Minus infinity gives 0.
  static V exp2(V x) {
    const V f = _mm512_reduce_ps(x, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC);
    V p = set(7.8024523e-02f);
    p = fma(p, f, set(2.2606716e-01f));
    p = fma(p, f, set(6.9583354e-01f));
    p = fma(p, f, set(9.9992522e-01f));
    return _mm512_scalef_ps(p, x);
  }
  // Lane i: (p0[i], p1[i]), rounded.
  static V pair(V p0, V p1) {
    const __m512i halves = reinterpret_cast<__m512i>(_mm512_cvtne2ps_pbh(p1, p0));
    alignas(64) static constexpr uint16_t kInterleave[32] = {
        0, 16, 1, 17, 2,  18, 3,  19, 4,  20, 5,  21, 6,  22, 7,  23,
        8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31};
    return _mm512_castsi512_ps(_mm512_permutexvar_epi16(_mm512_load_si512(kInterleave), halves));
  }
  // acc + both halves of each lane.
  static V add_pair(V acc, V words) {
    return dot(acc, words, _mm512_castsi512_ps(_mm512_set1_epi32(0x3f803f80)));  // (1, 1)
  }
};

}  // namespace

void attention_avx512bf16(const AttentionTask<uint16_t>& task) { run_attention<Bf16Words>(task); }

}  // namespace vggtcd
