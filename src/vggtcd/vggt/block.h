// SPDX-License-Identifier: Apache-2.0
// Block: one pre-norm transformer block with layer scale; upstream vggt.layers.block.Block. The
// ViT, the frame and global attention of the aggregator and the camera head's trunk are made of it.
#pragma once

#include <optional>
#include <vector>

#include "vggtcd/nn/attention.h"
#include "vggtcd/nn/linear.h"
#include "vggtcd/nn/norm.h"
#include "vggtcd/nn/qk_norm_rope.h"

namespace vggtcd {

struct BlockOptions {
  int64_t channels = 0;
  int64_t heads = 0;
  float eps = -1;        // of norm1 and norm2
  bool qk_norm = false;  // LayerNorm of every head's q and k, eps kEps
  // Of the products; attention is computed in types.compute, residual and norms are f32.
  ProductTypes types = {};
};

// The grid position of every token of one sequence, for the rotary embedding.
class TokenPositions {
 public:
  // Special tokens at (0, 0), then a patch grid whose cells are (y + 1, x + 1).
  TokenPositions(int64_t special, int64_t grid_height, int64_t grid_width);
  int64_t tokens() const { return tokens_; }
  // kRowBlock positions, those of row, row + 1, ... of a stack of such sequences.
  const RopePosition* from_row(int64_t row) const { return positions_.data() + row % tokens_; }

 private:
  int64_t tokens_;
  std::vector<RopePosition> positions_;  // one period and kRowBlock more
};

// Memory of a forward pass, for blocks of one width one after the other.
class BlockWorkspace {
 public:
  // rows: of all sequences together; hidden: the width of the MLP.
  BlockWorkspace(int64_t rows, int64_t channels, int64_t hidden, DType compute);

  Rows qkv;       // [rows, 3C]
  Rows attended;  // [rows, C]
  AttentionWorkspace attention;
  Rows normal(int worker) const;  // [kRowBlock, C]
  Rows hidden(int worker) const;  // [kRowBlock, hidden]

 private:
  DType compute_;
  int64_t channels_, hidden_width_;
  Buffer qkv_, attended_, normal_, hidden_;
};

class Block {
 public:
  Block(const WeightScope& scope, const BlockOptions& options);

  // x [sequences * tokens, C], in place: x += ls1(attn(norm1(x))), x += ls2(mlp(norm2(x))).
  // rope: null for none; then positions may be null too.
  void forward(const Rows& x, int64_t sequences, int64_t tokens, const RopeTable* rope,
               const TokenPositions* positions, BlockWorkspace& workspace) const;

  int64_t hidden() const { return fc1_.out(); }

 private:
  void project_qkv(const Rows& x, int64_t rows, const RopeTable* rope,
                   const TokenPositions* positions, const BlockWorkspace& workspace) const;
  void attend(int64_t sequences, int64_t tokens, BlockWorkspace& workspace) const;
  void project_and_mlp(const Rows& x, int64_t rows, const BlockWorkspace& workspace) const;

  BlockOptions options_;
  LayerNorm norm1_;
  Linear qkv_;
  std::optional<LayerNorm> q_norm_, k_norm_;
  Linear proj_;
  LayerNorm norm2_;
  Linear fc1_, fc2_;
};

// The blocks scope.0, scope.1, ... Their weights are packed in parallel.
std::vector<Block> make_blocks(const WeightScope& scope, int count, const BlockOptions& options);

}  // namespace vggtcd
