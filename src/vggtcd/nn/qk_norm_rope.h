// SPDX-License-Identifier: Apache-2.0
// What happens to q and k between the qkv product and attention: layer normalisation of every head,
// then rotary embedding of the patch position in two dimensions (upstream: q_norm, k_norm, rope).
#pragma once

#include <cstdint>
#include <vector>

namespace vggtcd {

// Cosines and sines of position * frequency_base^(-k / quarter), quarter = head_dim / 4,
// k < quarter, for 0 <= position < positions; computed in double, stored as float.
class RopeTable {
 public:
  RopeTable(int64_t head_dim, int64_t positions, double frequency_base);

  int64_t head_dim() const { return head_dim_; }
  int64_t positions() const { return positions_; }
  // [quarter] values for one position.
  const float* cosines(int64_t position) const;
  const float* sines(int64_t position) const;

 private:
  int64_t head_dim_, positions_;
  std::vector<float> cosines_, sines_;  // [positions, quarter]
};

// A patch's cell in the grid, as the table is indexed: VGGT's patches have (row + 1, column + 1),
// its camera and register tokens (0, 0).
struct RopePosition {
  int32_t y, x;
};

// What to do; leave out either part.
struct QkNormRope {
  int64_t heads;
  int64_t head_dim;  // a multiple of 4
  // LayerNorm over head_dim channels, all four [head_dim] or all null for none.
  const float* q_weight = nullptr;
  const float* q_bias = nullptr;
  const float* k_weight = nullptr;
  const float* k_bias = nullptr;
  float eps = -1;  // > 0 where there are weights
  // Rotary embedding, null for none. Row r has positions[r % position_count]: the positions of one
  // view's tokens serve all views. First half of the channels turns by y, second by x; inside a
  // half channel k pairs with k + quarter.
  const RopeTable* rope = nullptr;
  const RopePosition* positions = nullptr;
  int64_t position_count = 0;
};

// In place on the q and k blocks of qkv [rows, 3 * heads * head_dim], rows row_stride apart. f32
// arithmetic; error 1e-6 of the norm of a head, and in bf16 the rounding of the result.
void qk_norm_rope_f32(const QkNormRope& op, int64_t rows, float* qkv, int64_t row_stride);
void qk_norm_rope_bf16(const QkNormRope& op, int64_t rows, uint16_t* qkv, int64_t row_stride);

}  // namespace vggtcd
