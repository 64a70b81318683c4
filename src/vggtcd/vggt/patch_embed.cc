// SPDX-License-Identifier: Apache-2.0
// PatchEmbed: the ViT in front of the aggregator, in the order of the upstream forward_features.
#include "vggtcd/vggt/patch_embed.h"

#include <algorithm>

#include "vggtcd/core/parallel.h"
#include "vggtcd/vggt/position_embedding.h"

namespace vggtcd {
namespace {

// The convolution's weight [C, 3, patch, patch] as a product's [C, 3 * patch * patch].
Linear make_projection(const WeightScope& scope, const VggtConfig& config) {
  const int64_t in = 3 * config.patch_size * config.patch_size;
  const auto weight =
      scope.take_f32("weight", {config.channels, 3, config.patch_size, config.patch_size});
  return {weight, scope.take_f32("bias", {config.channels}), in, config.channels, {}};
}

// The pixels of one patch, (x - mean) / std, in the order of the weight: [3, patch, patch].
void gather_patch(const ImageBatch& images, int64_t frame, int64_t y, int64_t x, int64_t patch,
                  float* out) {
  for (int64_t c = 0; c < 3; ++c) {
    const float mean = kImageMean[static_cast<size_t>(c)], std = kImageStd[static_cast<size_t>(c)];
    const float* plane = images.pixels.data() + (frame * 3 + c) * images.height * images.width;
    for (int64_t dy = 0; dy < patch; ++dy) {
      const float* row = plane + (y * patch + dy) * images.width + x * patch;
      for (int64_t dx = 0; dx < patch; ++dx) *out++ = (row[dx] - mean) / std;
    }
  }
}

}  // namespace

PatchEmbed::PatchEmbed(const WeightScope& scope, const VggtConfig& config, ProductTypes types)
    : channels_(config.channels),
      patch_(config.patch_size),
      grid_(config.position_grid),
      special_(1 + config.vit_register_tokens),
      projection_(make_projection(scope.at("patch_embed.proj"), config)),
      blocks_(make_blocks(scope.at("blocks"), config.vit_depth,
                          {.channels = config.channels,
                           .heads = config.vit_heads,
                           .eps = kVitEps,
                           .types = types})),
      norm_(scope.at("norm"), config.channels, kVitEps) {
  positions_ = scope.take_f32("pos_embed", {1, 1 + grid_ * grid_, channels_});
  special_tokens_ = scope.take_f32("cls_token", {1, 1, channels_});
  for (int64_t c = 0; c < channels_; ++c) {
    special_tokens_[static_cast<size_t>(c)] += positions_[static_cast<size_t>(c)];
  }
  positions_.erase(positions_.begin(), positions_.begin() + channels_);  // the class token's
  const auto registers = scope.take_f32("register_tokens", {1, special_ - 1, channels_});
  special_tokens_.insert(special_tokens_.end(), registers.begin(), registers.end());
  if (scope.contains("mask_token")) scope.take("mask_token", {1, channels_});  // for training only
}

// x = cat(cls + pos, registers, patch_embed(x) + pos): prepare_tokens_with_masks
void PatchEmbed::embed(const ImageBatch& images, const Rows& tokens) const {
  const int64_t height = images.height / patch_, width = images.width / patch_;
  const int64_t patches = height * width, per_frame = special_ + patches;
  const std::vector<float> positions =
      resample_position_grid(positions_, grid_, channels_, height, width);
  const int64_t in = 3 * patch_ * patch_;
  Buffer gathered(bytes_of(DType::kF32, kRowBlock * num_threads(), in));
  const int64_t chunks = num_chunks(patches, kRowBlock);
  parallel_for_workers(images.frames * chunks, 1, [&](int64_t chunk, int64_t, int worker) {
    const int64_t frame = chunk / chunks, first = chunk % chunks * kRowBlock;
    const int64_t count = std::min(kRowBlock, patches - first);
    const Rows pixels = Rows(DType::kF32, gathered, in).at(worker * kRowBlock);
    for (int64_t i = 0; i < count; ++i) {
      gather_patch(images, frame, (first + i) / width, (first + i) % width, patch_,
                   pixels.at(i).f32());
    }
    const Rows out = tokens.at(frame * per_frame + special_ + first);
    projection_.run(count, pixels, out);  // [count, 3 * 14 * 14] -> [count, C]
    for (int64_t i = 0; i < count; ++i) {
      const float* position = positions.data() + (first + i) * channels_;
      float* token = out.at(i).f32();
      for (int64_t c = 0; c < channels_; ++c) token[c] += position[c];
    }
  });
  for (int64_t frame = 0; frame < images.frames; ++frame) {
    std::copy(special_tokens_.begin(), special_tokens_.end(), tokens.at(frame * per_frame).f32());
  }
}

void PatchEmbed::forward(const ImageBatch& images, const Rows& out, int64_t rows_per_frame,
                         int64_t first_row, BlockWorkspace& workspace, const Trace& trace,
                         const std::function<void()>& after_block) const {
  const int64_t patches = images.height / patch_ * (images.width / patch_);
  const int64_t per_frame = special_ + patches, rows = images.frames * per_frame;
  Buffer memory(bytes_of(DType::kF32, rows, channels_));
  const Rows tokens(DType::kF32, memory, channels_);
  const auto show = [&](std::string name) {
    if (trace) {
      trace_tensor(trace, std::move(name), {images.frames, per_frame, channels_}, tokens.f32());
    }
  };
  embed(images, tokens);
  show("vit_embed");
  for (size_t i = 0; i < blocks_.size(); ++i) {
    // x = blk(x)
    blocks_[i].forward(tokens, images.frames, per_frame, nullptr, nullptr, workspace);
    show(fmt::format("vit_block_{:02}", i));
    after_block();
  }
  // x_norm_patchtokens = norm(x)[:, 1 + registers :]
  parallel_for(images.frames, 1, [&](int64_t frame, int64_t) {
    norm_.run(patches, tokens.at(frame * per_frame + special_),
              out.at(frame * rows_per_frame + first_row));
  });
}

}  // namespace vggtcd
