// SPDX-License-Identifier: Apache-2.0
// Attention: shape checks, partition over (sequence, head, queries) and choice of the kernel.
#include "vggtcd/nn/attention.h"

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/nn/reference.h"

namespace vggtcd {
namespace {

template <typename T>
void attention_reference(const AttentionShape& shape, const T* q, const T* k, const T* v,
                         int64_t row_stride, T* out, int64_t out_row_stride, float scale) {
  const int64_t rows = shape.sequences * shape.tokens;
  parallel_for(rows * shape.heads, 16, [&](int64_t begin, int64_t end) {
    std::vector<float> scores;
    for (int64_t i = begin; i < end; ++i) {
      const int64_t row = i / shape.heads, column = i % shape.heads * shape.head_dim;
      const int64_t first = row / shape.tokens * shape.tokens * row_stride + column;
      reference::attention_row<float>(shape.tokens, shape.head_dim, q + row * row_stride + column,
                                      k + first, v + first, row_stride,
                                      out + row * out_row_stride + column, scale, scores);
    }
  });
}

void check_shape(const AttentionShape& shape, int64_t row_stride, int64_t out_row_stride) {
  check(shape.sequences >= 0 && shape.tokens >= 0 && shape.heads >= 1, "attention: shape");
  check(shape.head_dim == 64 || shape.head_dim == 128, "attention: head_dim is 64 or 128");
  check(row_stride >= shape.heads * shape.head_dim, "attention: row_stride");
  check(out_row_stride >= shape.heads * shape.head_dim, "attention: out_row_stride");
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

size_t attention_workspace_bytes(const AttentionShape&, bool) { return 0; }

void attention_f32(const AttentionShape& shape, const float* q, const float* k, const float* v,
                   int64_t row_stride, float* out, int64_t out_row_stride, float scale,
                   AttentionWorkspace&) {
  check_shape(shape, row_stride, out_row_stride);
  attention_reference(shape, q, k, v, row_stride, out, out_row_stride, scale);
}

void attention_bf16(const AttentionShape& shape, const uint16_t* q, const uint16_t* k,
                    const uint16_t* v, int64_t row_stride, uint16_t* out, int64_t out_row_stride,
                    float scale, AttentionWorkspace&) {
  check_shape(shape, row_stride, out_row_stride);
  attention_reference(shape, q, k, v, row_stride, out, out_row_stride, scale);
}

}  // namespace vggtcd
