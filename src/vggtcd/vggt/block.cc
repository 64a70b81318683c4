// SPDX-License-Identifier: Apache-2.0
// Block: two loops over blocks of rows with attention between them. Inside a loop a worker carries
// its rows through several layers while they are in its cache; nothing as wide as the MLP is ever
// stored for all tokens.
#include "vggtcd/vggt/block.h"

#include <cmath>

#include "vggtcd/core/parallel.h"
#include "vggtcd/vggt/config.h"

namespace vggtcd {
namespace {

int64_t hidden_width(const WeightScope& scope) {
  const auto& shape = scope.shape("mlp.fc1.bias");
  return shape.empty() ? 0 : shape[0];
}

LinearOptions scaled_residual(const WeightScope& scope, const char* gamma,
                              const BlockOptions& options) {
  return {.types = options.types, .gamma = scope.take_f32(gamma, {options.channels})};
}

}  // namespace

TokenPositions::TokenPositions(int64_t special, int64_t grid_height, int64_t grid_width)
    : tokens_(special + grid_height * grid_width) {
  positions_.resize(static_cast<size_t>(special), {0, 0});
  for (int32_t y = 0; y < grid_height; ++y) {
    for (int32_t x = 0; x < grid_width; ++x) positions_.push_back({y + 1, x + 1});
  }
  for (size_t row = 0; row < static_cast<size_t>(kRowBlock); ++row) {
    positions_.push_back(positions_[row]);
  }
}

BlockWorkspace::BlockWorkspace(int64_t rows, int64_t channels, int64_t hidden, DType compute)
    : compute_(compute), channels_(channels), hidden_width_(hidden) {
  const int64_t worker_rows = kRowBlock * num_threads();
  qkv_.reserve(bytes_of(compute, rows, 3 * channels));
  attended_.reserve(bytes_of(compute, rows, channels));
  normal_.reserve(bytes_of(compute, worker_rows, channels));
  hidden_.reserve(bytes_of(compute, worker_rows, hidden));
  qkv = Rows(compute, qkv_, 3 * channels);
  attended = Rows(compute, attended_, channels);
}

Rows BlockWorkspace::normal(int worker) const {
  return Rows(compute_, normal_, channels_).at(worker * kRowBlock);
}

Rows BlockWorkspace::hidden(int worker) const {
  return Rows(compute_, hidden_, hidden_width_).at(worker * kRowBlock);
}

Block::Block(const WeightScope& scope, const BlockOptions& options)
    : options_(options),
      norm1_(scope.at("norm1"), options.channels, options.eps),
      qkv_(scope.at("attn.qkv"), options.channels, 3 * options.channels,
           {.types = options.types, .output = options.types.compute}),
      proj_(scope.at("attn.proj"), options.channels, options.channels,
            scaled_residual(scope, "ls1.gamma", options)),
      norm2_(scope.at("norm2"), options.channels, options.eps),
      fc1_(scope.at("mlp.fc1"), options.channels, hidden_width(scope),
           {.types = options.types,
            .output = options.types.compute,
            .activation = Activation::kGelu}),
      fc2_(scope.at("mlp.fc2"), hidden_width(scope), options.channels,
           scaled_residual(scope, "ls2.gamma", options)) {
  if (options.qk_norm) {
    const int64_t head_dim = options.channels / options.heads;
    q_norm_.emplace(scope.at("attn.q_norm"), head_dim, kEps);
    k_norm_.emplace(scope.at("attn.k_norm"), head_dim, kEps);
  }
}

void Block::forward(const Rows& x, int64_t sequences, int64_t tokens, const RopeTable* rope,
                    const TokenPositions* positions, BlockWorkspace& workspace) const {
  project_qkv(x, sequences * tokens, rope, positions, workspace);
  attend(sequences, tokens, workspace);
  project_and_mlp(x, sequences * tokens, workspace);
}

// qkv = attn.qkv(norm1(x)); q, k = rope(q_norm(q)), rope(k_norm(k))
void Block::project_qkv(const Rows& x, int64_t rows, const RopeTable* rope,
                        const TokenPositions* positions, const BlockWorkspace& workspace) const {
  QkNormRope op{.heads = options_.heads, .head_dim = options_.channels / options_.heads};
  if (q_norm_) {
    op.q_weight = q_norm_->weight();
    op.q_bias = q_norm_->bias();
    op.k_weight = k_norm_->weight();
    op.k_bias = k_norm_->bias();
    op.eps = q_norm_->eps();
  }
  op.rope = rope;
  op.position_count = kRowBlock;
  parallel_for_workers(rows, kRowBlock, [&](int64_t begin, int64_t end, int worker) {
    const int64_t count = end - begin;
    const Rows normal = workspace.normal(worker);
    const Rows qkv = workspace.qkv.at(begin);
    norm1_.run(count, x.at(begin), normal);
    qkv_.run(count, normal, qkv);  // [count, C] -> [count, 3C]
    if (!q_norm_ && rope == nullptr) return;
    QkNormRope here = op;
    if (rope != nullptr) here.positions = positions->from_row(begin);
    if (qkv.dtype == DType::kF32) {
      qk_norm_rope_f32(here, count, qkv.f32(), qkv.stride);
    } else {
      qk_norm_rope_bf16(here, count, qkv.bf16(), qkv.stride);
    }
  });
}

// softmax(q k^T / sqrt(head_dim)) v
void Block::attend(int64_t sequences, int64_t tokens, BlockWorkspace& workspace) const {
  const int64_t channels = options_.channels;
  const AttentionShape shape{sequences, tokens, options_.heads, channels / options_.heads};
  const float scale = 1.0f / std::sqrt(static_cast<float>(shape.head_dim));
  const Rows q = workspace.qkv, k = q.at(0, channels), v = q.at(0, 2 * channels);
  const Rows& out = workspace.attended;
  if (q.dtype == DType::kF32) {
    attention_f32(shape, q.f32(), k.f32(), v.f32(), q.stride, out.f32(), out.stride, scale,
                  workspace.attention);
  } else {
    attention_bf16(shape, q.bf16(), k.bf16(), v.bf16(), q.stride, out.bf16(), out.stride, scale,
                   workspace.attention);
  }
}

// x += ls1(attn.proj(attended)); x += ls2(mlp.fc2(gelu(mlp.fc1(norm2(x)))))
void Block::project_and_mlp(const Rows& x, int64_t rows, const BlockWorkspace& workspace) const {
  parallel_for_workers(rows, kRowBlock, [&](int64_t begin, int64_t end, int worker) {
    const int64_t count = end - begin;
    const Rows normal = workspace.normal(worker);
    const Rows hidden = workspace.hidden(worker);
    const Rows here = x.at(begin);
    proj_.run(count, workspace.attended.at(begin), here);
    norm2_.run(count, here, normal);
    fc1_.run(count, normal, hidden);  // [count, C] -> [count, 4C]
    fc2_.run(count, hidden, here);
  });
}

std::vector<Block> make_blocks(const WeightScope& scope, int count, const BlockOptions& options) {
  std::vector<std::optional<Block>> made(static_cast<size_t>(count));
  parallel_for(count, 1, [&](int64_t i, int64_t) {
    made[static_cast<size_t>(i)].emplace(scope.at(std::to_string(i)), options);
  });
  std::vector<Block> blocks;
  blocks.reserve(made.size());
  for (auto& block : made) blocks.push_back(std::move(*block));
  return blocks;
}

}  // namespace vggtcd
