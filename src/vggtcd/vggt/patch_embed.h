// SPDX-License-Identifier: Apache-2.0
// PatchEmbed: photo -> one token per patch, a DINOv2 vision transformer with register tokens;
// upstream aggregator.patch_embed (vggt.layers.vision_transformer.DinoVisionTransformer).
#pragma once

#include <functional>
#include <vector>

#include "vggtcd/vggt/block.h"
#include "vggtcd/vggt/config.h"
#include "vggtcd/vggt/image_batch.h"
#include "vggtcd/vggt/trace.h"

namespace vggtcd {

class PatchEmbed {
 public:
  // scope: aggregator.patch_embed.
  PatchEmbed(const WeightScope& scope, const VggtConfig& config, ProductTypes types);

  // Writes the patch tokens of frame s to rows s * rows_per_frame + first_row + p of out (f32).
  // after_block is called after each block.
  void forward(const ImageBatch& images, const Rows& out, int64_t rows_per_frame, int64_t first_row,
               BlockWorkspace& workspace, const Trace& trace,
               const std::function<void()>& after_block) const;

  int64_t special_tokens() const { return special_; }
  int64_t hidden() const { return blocks_.front().hidden(); }

 private:
  void embed(const ImageBatch& images, const Rows& tokens) const;

  int64_t channels_, patch_, grid_, special_;
  Linear projection_;                  // patch_embed.proj, a convolution of stride patch
  std::vector<float> special_tokens_;  // [1 + registers, C], the class token with its position
  std::vector<float> positions_;       // [grid, grid, C]
  std::vector<Block> blocks_;
  LayerNorm norm_;
};

}  // namespace vggtcd
