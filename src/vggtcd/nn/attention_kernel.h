// SPDX-License-Identifier: Apache-2.0
// The attention kernel: up to kQueriesPerTask queries of one head against all its keys, in one pass
// with a running softmax (Dao et al., FlashAttention; Milakov & Gimelshein, online normaliser).
//
// Queries lie along the lanes: a score tile is [keys, 3 vectors of queries], so maximum, sum and
// rescaling of the softmax are vertical and nothing is ever reduced across lanes. Both products,
// scores = k q^T and out^T = v^T p^T, are then one micro-kernel: rows of broadcast words times 3
// vectors. Keys are read in their natural layout. A "word" is what one lane multiplies in one step:
// one f32, or a pair of bf16 (vdpbf16ps).
//
// The exponent is exp2(scale * log2(e) * score - reference). The reference of a query is an integer
// that is raised only when a score exceeds it by more than kHeadroom, so that raising it multiplies
// what was summed before by a power of two: rare, and exact.
#pragma once

#include <cstdint>

namespace vggtcd {

constexpr int64_t kQueriesPerTask = 192;
// Keys are packed up to a multiple of this.
constexpr int64_t kKeyPadding = 8;
// Steps of the products over the keys of one block: 64 keys in f32, 128 in bf16, so that keys,
// values and probabilities of a block stay in the first-level cache in turns.
constexpr int64_t kStepsPerKeyBlock = 64;

// One call of a kernel. Rows of q and out are heads of tokens, T = float or uint16_t (bf16).
template <typename T>
struct AttentionTask {
  int64_t queries;  // 1 .. kQueriesPerTask
  int64_t tokens;   // keys, >= 1
  int64_t head_dim;
  const T* q;
  int64_t q_stride;
  // Words of the head's keys [padded tokens, head_dim] (the last key repeated) and values (zeros);
  // with pairs, keys [padded tokens, head_dim / 2] and values [padded tokens / 2, head_dim].
  const float* keys;
  const float* values;
  T* out;
  int64_t out_stride;
  float scale;     // > 0
  float* scratch;  // 64-byte aligned, attention_scratch_floats(head_dim)
};

constexpr int64_t attention_scratch_floats(int64_t head_dim) {
  // Queries, output, reference and sum of every query; probabilities and scores of one block.
  return kQueriesPerTask * (2 * head_dim + 2) + (kStepsPerKeyBlock + kKeyPadding) * 48;
}

// Pairs == false: words are f32. attention_avx512bf16 is the one with words of bf16 pairs.
void attention_avx2(const AttentionTask<float>& task);
void attention_avx2(const AttentionTask<uint16_t>& task);
void attention_avx512(const AttentionTask<float>& task);
void attention_avx512(const AttentionTask<uint16_t>& task);
void attention_avx512bf16(const AttentionTask<uint16_t>& task);

}  // namespace vggtcd
