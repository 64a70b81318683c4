// SPDX-License-Identifier: Apache-2.0
// Multi-head softmax attention, out = softmax(scale * q k^T) v, without ever storing a tokens x
// tokens matrix: scaled_dot_product_attention of the upstream network (no mask, no dropout).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace vggtcd {

// Sequences attend within themselves only: frame attention has one sequence per view, global
// attention one for all.
struct AttentionShape {
  int64_t sequences;
  int64_t tokens;  // of one sequence
  int64_t heads;
  int64_t head_dim;  // 64 or 128
};

// Scratch memory of attention: packed keys and values and what each worker needs. Grows to the
// largest shape it has seen (linear in tokens, see attention_workspace_bytes) and stays; for one
// call at a time.
class AttentionWorkspace {
 public:
  // 64-byte aligned; contents undefined.
  float* resize(size_t floats);

 private:
  std::vector<float> memory_;
};

// The size to which a call with this shape grows its workspace, at the current number of threads
// and CpuLevel.
size_t attention_workspace_bytes(const AttentionShape& shape, bool bf16);

// q, k, v: row = token, sequence b at rows [b * tokens, (b + 1) * tokens), head h at columns
// [h * head_dim, (h + 1) * head_dim); rows are row_stride elements apart, so that they may be the
// three column blocks of one [rows, 3C] product. out: the same layout, rows out_row_stride apart;
// must not overlap the inputs.
//
// Error: in f32 that of f32 dot products (rel L2 about 1e-6 for scores of order one; the exponent
// carries the absolute error of a score, about 2^-24 |scale| sum |q k| + 2^-24 |score|). In bf16
// products and softmax are f32; probabilities are rounded to bf16 where the processor multiplies
// bf16 and the result always, so |error| <= 2^-8 (sum p |v| + 2 |out|) beside that of the scores.
// Same bits for any number of threads. docs/numerics.md has the tests.
void attention_f32(const AttentionShape& shape, const float* q, const float* k, const float* v,
                   int64_t row_stride, float* out, int64_t out_row_stride, float scale,
                   AttentionWorkspace& workspace);
void attention_bf16(const AttentionShape& shape, const uint16_t* q, const uint16_t* k,
                    const uint16_t* v, int64_t row_stride, uint16_t* out, int64_t out_row_stride,
                    float scale, AttentionWorkspace& workspace);

}  // namespace vggtcd
