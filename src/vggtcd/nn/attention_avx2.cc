// SPDX-License-Identifier: Apache-2.0
// The attention kernel on AVX2, products in f32.
#include "vggtcd/nn/attention_kernel_impl.h"
#include "vggtcd/nn/simd_avx2.h"

namespace vggtcd {

void attention_avx2(const AttentionTask<float>& task) { run_attention<F32Words<Avx2>>(task); }
void attention_avx2(const AttentionTask<uint16_t>& task) { run_attention<F32Words<Avx2>>(task); }

}  // namespace vggtcd
