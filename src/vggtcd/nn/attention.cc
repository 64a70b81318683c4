// SPDX-License-Identifier: Apache-2.0
// Attention: packs keys and values of some heads, then runs the kernel of this processor on fixed
// blocks of their queries.
#include "vggtcd/nn/attention.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "vggtcd/core/cpu_features.h"
#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/nn/attention_kernel.h"
#include "vggtcd/nn/reference.h"

namespace vggtcd {
namespace {

constexpr int64_t kLargestHeadDim = 128;

// A head of one sequence is the unit of packing. Heads are packed in groups of about this many
// tokens: enough work per parallel loop, little memory.
constexpr int64_t kTokensPerGroup = 1 << 16;
constexpr int64_t kKeysPerPackingTask = 64;  // even: a pair of values is one task's

template <typename T>
struct Call {
  AttentionShape shape;
  const T *q, *k, *v;
  int64_t row_stride;
  T* out;
  int64_t out_row_stride;
  float scale;
};

// How much is packed at once and where it lies; all sizes in floats (words of a head, see
// attention_kernel.h).
struct Layout {
  int64_t padded_tokens;
  int64_t per_word;     // elements in a word: 2 for pairs of bf16
  int64_t block_words;  // keys, or values, of one head
  int64_t group;        // heads packed at once
  int64_t scratch;      // of one worker

  Layout(const AttentionShape& shape, bool pairs) {
    padded_tokens = num_chunks(shape.tokens, kKeyPadding) * kKeyPadding;
    per_word = pairs ? 2 : 1;
    block_words = padded_tokens * shape.head_dim / per_word;
    const int64_t heads = shape.sequences * shape.heads;
    group = std::clamp(kTokensPerGroup / std::max<int64_t>(1, shape.tokens), int64_t{1},
                       std::max<int64_t>(1, heads));
    scratch = num_chunks(attention_scratch_floats(shape.head_dim), 16) * 16;
  }
  int64_t floats() const { return 2 * group * block_words + num_threads() * scratch; }
};

bool multiplies_pairs(bool bf16) { return bf16 && cpu_level() >= CpuLevel::kAvx512Bf16; }

void run_kernel(const AttentionTask<float>& task) {
  return cpu_level() >= CpuLevel::kAvx512 ? attention_avx512(task) : attention_avx2(task);
}

void run_kernel(const AttentionTask<uint16_t>& task) {
  if (multiplies_pairs(true)) return attention_avx512bf16(task);
  return cpu_level() >= CpuLevel::kAvx512 ? attention_avx512(task) : attention_avx2(task);
}

void to_f32_words(const float* row, int64_t head_dim, float* words) {
  std::copy_n(row, head_dim, words);
}

void to_f32_words(const uint16_t* row, int64_t head_dim, float* words) {
  for (int64_t c = 0; c < head_dim; ++c) words[c] = float_from_bfloat16(row[c]);
}

// Words (even[c], odd[c]) of two rows of values.
void to_pair_words(const uint16_t* even, const uint16_t* odd, int64_t head_dim, float* words) {
  for (int64_t c = 0; c < head_dim; ++c) {
    words[c] = std::bit_cast<float>(even[c] | static_cast<uint32_t>(odd[c]) << 16);
  }
}

// The offset of a head's first element: head i of all sequences.
template <typename T>
int64_t head_offset(const Call<T>& call, int64_t i, int64_t row_stride) {
  return i / call.shape.heads * call.shape.tokens * row_stride +
         i % call.shape.heads * call.shape.head_dim;
}

// Row i of one head's keys and values, i < padded_tokens; k and v: the head's first row.
template <typename T>
void pack_row(const Call<T>& call, const Layout& layout, const T* k, const T* v, int64_t i,
              float* keys, float* values) {
  const int64_t tokens = call.shape.tokens, head_dim = call.shape.head_dim;
  const T* key = k + std::min(i, tokens - 1) * call.row_stride;
  const T* value = i < tokens ? v + i * call.row_stride : nullptr;
  float* key_words = keys + i * head_dim / layout.per_word;
  float* value_words = values + i / layout.per_word * head_dim;
  if (layout.per_word == 1) {
    to_f32_words(key, head_dim, key_words);
    if (value) {
      to_f32_words(value, head_dim, value_words);
    } else {
      std::fill_n(value_words, head_dim, 0.0f);
    }
    return;
  }
  if constexpr (sizeof(T) == 2) {
    std::memcpy(key_words, key, static_cast<size_t>(head_dim) * sizeof(T));
    if (i % 2 == 1) return;  // done with the row before
    if (value) {
      if (i + 1 < tokens) {
        to_pair_words(value, value + call.row_stride, head_dim, value_words);
      } else {
        const uint16_t zeros[kLargestHeadDim] = {};
        to_pair_words(value, zeros, head_dim, value_words);
      }
    } else {
      std::fill_n(value_words, head_dim, 0.0f);
    }
  }
}

// Packs heads [first, first + count), row by row, because the heads of a row are neighbours.
template <typename T>
void pack(const Call<T>& call, const Layout& layout, int64_t first, int64_t count, float* keys,
          float* values) {
  parallel_for(layout.padded_tokens, kKeysPerPackingTask, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      for (int64_t h = 0; h < count; ++h) {
        const int64_t offset = head_offset(call, first + h, call.row_stride);
        pack_row(call, layout, call.k + offset, call.v + offset, i, keys + h * layout.block_words,
                 values + h * layout.block_words);
      }
    }
  });
}

template <typename T>
void attention_vector(const Call<T>& call, AttentionWorkspace& workspace) {
  const AttentionShape& shape = call.shape;
  const Layout layout(shape, multiplies_pairs(sizeof(T) == 2));
  float* const keys = workspace.resize(static_cast<size_t>(layout.floats()));
  float* const values = keys + layout.group * layout.block_words;
  float* const scratch = values + layout.group * layout.block_words;
  const int64_t tasks = num_chunks(shape.tokens, kQueriesPerTask);
  const int64_t heads = shape.sequences * shape.heads;
  for (int64_t first = 0; first < heads; first += layout.group) {
    const int64_t count = std::min(layout.group, heads - first);
    pack(call, layout, first, count, keys, values);
    parallel_for_workers(count * tasks, 1, [&](int64_t task, int64_t, int worker) {
      const int64_t h = task / tasks, query = task % tasks * kQueriesPerTask;
      AttentionTask<T> block;
      block.queries = std::min(kQueriesPerTask, shape.tokens - query);
      block.tokens = shape.tokens;
      block.head_dim = shape.head_dim;
      block.q = call.q + head_offset(call, first + h, call.row_stride) + query * call.row_stride;
      block.q_stride = call.row_stride;
      block.keys = keys + h * layout.block_words;
      block.values = values + h * layout.block_words;
      block.out = call.out + head_offset(call, first + h, call.out_row_stride) +
                  query * call.out_row_stride;
      block.out_stride = call.out_row_stride;
      block.scale = call.scale;
      block.scratch = scratch + worker * layout.scratch;
      run_kernel(block);
    });
  }
}

template <typename T>
void attention_reference(const Call<T>& call) {
  const AttentionShape& shape = call.shape;
  parallel_for(shape.sequences * shape.heads * shape.tokens, 16, [&](int64_t begin, int64_t end) {
    std::vector<float> scores;
    for (int64_t i = begin; i < end; ++i) {
      const int64_t head = i / shape.tokens, token = i % shape.tokens;
      const int64_t from = head_offset(call, head, call.row_stride);
      const int64_t to = head_offset(call, head, call.out_row_stride);
      reference::attention_row<float>(
          shape.tokens, shape.head_dim, call.q + from + token * call.row_stride, call.k + from,
          call.v + from, call.row_stride, call.out + to + token * call.out_row_stride, call.scale,
          scores);
    }
  });
}

template <typename T>
void attention(const Call<T>& call, AttentionWorkspace& workspace) {
  const AttentionShape& shape = call.shape;
  check(shape.sequences >= 0 && shape.tokens >= 0 && shape.heads >= 1, "attention: shape");
  check(shape.head_dim == 64 || shape.head_dim == 128, "attention: head_dim is 64 or 128");
  check(call.row_stride >= shape.heads * shape.head_dim && call.row_stride % 2 == 0,
        "attention: row_stride");
  check(call.out_row_stride >= shape.heads * shape.head_dim, "attention: out_row_stride");
  check(call.scale > 0, "attention: scale");
  if (shape.sequences == 0 || shape.tokens == 0) return;
  if (cpu_level() == CpuLevel::kReference) return attention_reference(call);
  attention_vector(call, workspace);
}

}  // namespace

float* AttentionWorkspace::resize(size_t floats) {
  constexpr size_t kAlignment = 64;
  const size_t padded = floats + kAlignment / sizeof(float);
  if (memory_.size() < padded) {
    memory_.clear();  // nothing to copy over
    memory_.resize(padded);
  }
  const auto address = reinterpret_cast<uintptr_t>(memory_.data());
  return memory_.data() + (kAlignment - address % kAlignment) % kAlignment / sizeof(float);
}

size_t attention_workspace_bytes(const AttentionShape& shape, bool bf16) {
  if (cpu_level() == CpuLevel::kReference) return 0;
  const Layout layout(shape, multiplies_pairs(bf16));
  return static_cast<size_t>(layout.floats()) * sizeof(float) + 64;
}

void attention_f32(const AttentionShape& shape, const float* q, const float* k, const float* v,
                   int64_t row_stride, float* out, int64_t out_row_stride, float scale,
                   AttentionWorkspace& workspace) {
  attention(Call<float>{shape, q, k, v, row_stride, out, out_row_stride, scale}, workspace);
}

void attention_bf16(const AttentionShape& shape, const uint16_t* q, const uint16_t* k,
                    const uint16_t* v, int64_t row_stride, uint16_t* out, int64_t out_row_stride,
                    float scale, AttentionWorkspace& workspace) {
  attention(Call<uint16_t>{shape, q, k, v, row_stride, out, out_row_stride, scale}, workspace);
}

}  // namespace vggtcd
