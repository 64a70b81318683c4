// SPDX-License-Identifier: Apache-2.0
// Aggregator: alternating attention. Frame and global attention read the same rows: a frame's
// tokens are one sequence, or all frames' are.
#include "vggtcd/vggt/aggregator.h"

#include <algorithm>
#include <cstring>

#include "vggtcd/core/parallel.h"

namespace vggtcd {
namespace {

std::vector<Block> make_attention(const WeightScope& scope, const VggtConfig& config,
                                  ProductTypes types) {
  return make_blocks(scope, config.depth,
                     {.channels = config.channels,
                      .heads = config.heads,
                      .eps = kEps,
                      .qk_norm = true,
                      .types = types});
}

// Copies x [rows, C] to columns [column, column + C) of kept.
void keep(const Rows& x, int64_t rows, int64_t channels, const Rows& kept, int64_t column) {
  parallel_for(rows, kRowBlock, [&](int64_t begin, int64_t end) {
    for (int64_t row = begin; row < end; ++row) {
      std::memcpy(kept.at(row, column).f32(), x.at(row).f32(), bytes_of(DType::kF32, 1, channels));
    }
  });
}

void show_patches(const Trace& trace, const AggregatedTokens& shape, const Rows& x) {
  if (!trace) return;
  const int64_t patches = shape.grid_height * shape.grid_width, channels = x.stride;
  std::vector<float> copy;
  for (int64_t frame = 0; frame < shape.frames; ++frame) {
    const float* first = x.at(frame * shape.tokens() + shape.special).f32();
    copy.insert(copy.end(), first, first + patches * channels);
  }
  trace_tensor(trace, "patch_tokens", {shape.frames, patches, channels}, copy.data());
}

}  // namespace

Aggregator::Aggregator(const WeightScope& scope, const VggtConfig& config, ProductTypes types)
    : config_(config),
      compute_(types.compute),
      patch_embed_(scope.at("patch_embed"), config, types),
      frame_blocks_(make_attention(scope.at("frame_blocks"), config, types)),
      global_blocks_(make_attention(scope.at("global_blocks"), config, types)) {
  const int64_t registers = config.register_tokens, channels = config.channels;
  const auto camera = scope.take_f32("camera_token", {1, 2, 1, channels});
  const auto others = scope.take_f32("register_token", {1, 2, registers, channels});
  // Entry 0 of both is the first frame's, entry 1 that of all others.
  const auto special = [&](int64_t entry) {
    std::vector<float> tokens(camera.begin() + entry * channels,
                              camera.begin() + (entry + 1) * channels);
    tokens.insert(tokens.end(), others.begin() + entry * registers * channels,
                  others.begin() + (entry + 1) * registers * channels);
    return tokens;
  };
  first_special_ = special(0);
  other_special_ = special(1);
}

// tokens = cat(camera_token, register_token, patch_tokens): slice_expand_and_flatten
void Aggregator::insert_special_tokens(const AggregatedTokens& shape, const Rows& x) const {
  for (int64_t frame = 0; frame < shape.frames; ++frame) {
    const std::vector<float>& special = frame == 0 ? first_special_ : other_special_;
    std::copy(special.begin(), special.end(), x.at(frame * shape.tokens()).f32());
  }
}

AggregatedTokens Aggregator::forward(const ImageBatch& images, const Trace& trace,
                                     const std::function<void(VggtStage)>& after_block) const {
  const int64_t channels = config_.channels;
  AggregatedTokens out;
  out.frames = images.frames;
  out.grid_height = images.height / config_.patch_size;
  out.grid_width = images.width / config_.patch_size;
  out.special = config_.special_tokens();
  out.channels = 2 * channels;
  const int64_t rows = out.frames * out.tokens();
  const int64_t vit_rows =
      out.frames * (patch_embed_.special_tokens() + out.grid_height * out.grid_width);

  BlockWorkspace workspace(std::max(rows, vit_rows), channels, frame_blocks_.front().hidden(),
                           compute_);
  Buffer memory(bytes_of(DType::kF32, rows, channels));
  const Rows x(DType::kF32, memory, channels);  // [S, special + P, C]

  // patch_tokens = self.patch_embed(images)["x_norm_patchtokens"]
  patch_embed_.forward(images, x, out.tokens(), out.special, workspace, trace,
                       [&] { after_block(VggtStage::kPatchEmbed); });
  show_patches(trace, out, x);
  insert_special_tokens(out, x);

  // pos = self.position_getter(...) + 1, zeros for the special tokens
  const TokenPositions positions(out.special, out.grid_height, out.grid_width);
  const RopeTable rope(channels / config_.heads, std::max(out.grid_height, out.grid_width) + 1,
                       config_.rope_frequency);
  const auto show = [&](const char* stage, int layer) {
    if (!trace) return;
    trace_tensor(trace, fmt::format("{}_{:02}", stage, layer), {out.frames, out.tokens(), channels},
                 x.f32());
  };
  size_t kept = 0;
  for (int layer = 0; layer < config_.depth; ++layer) {
    const auto i = static_cast<size_t>(layer);
    const bool keep_this = kept < out.layers.size() && config_.dpt_layers[kept] == layer;
    if (keep_this) out.layers[kept].reserve(bytes_of(DType::kF32, rows, 2 * channels));
    const Rows target(DType::kF32, out.layers[std::min<size_t>(kept, 3)], 2 * channels);
    // tokens = self._process_frame_attention(tokens, ...)
    frame_blocks_[i].forward(x, out.frames, out.tokens(), &rope, &positions, workspace);
    show("frame", layer);
    after_block(VggtStage::kFrameAttention);
    if (keep_this) keep(x, rows, channels, target, 0);
    // tokens = self._process_global_attention(tokens, ...)
    global_blocks_[i].forward(x, 1, rows, &rope, &positions, workspace);
    show("global", layer);
    after_block(VggtStage::kGlobalAttention);
    if (!keep_this) continue;
    // concat_inter = cat(frame_intermediates, global_intermediates)
    keep(x, rows, channels, target, channels);
    if (trace) {
      trace_tensor(trace, fmt::format("head_tokens_{}", kept),
                   {out.frames, out.tokens(), 2 * channels}, target.f32());
    }
    ++kept;
  }
  return out;
}

}  // namespace vggtcd
