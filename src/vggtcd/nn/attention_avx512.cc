// SPDX-License-Identifier: Apache-2.0
// The attention kernel on AVX-512, products in f32.
#include "vggtcd/nn/attention_kernel_impl.h"
#include "vggtcd/nn/simd_avx512.h"

namespace vggtcd {

void attention_avx512(const AttentionTask<float>& task) { run_attention<F32Words<Avx512>>(task); }
void attention_avx512(const AttentionTask<uint16_t>& task) {
  run_attention<F32Words<Avx512>>(task);
}

}  // namespace vggtcd
