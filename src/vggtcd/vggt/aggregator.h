// SPDX-License-Identifier: Apache-2.0
// Aggregator: photos -> tokens, attention within every frame and across all frames in turn;
// upstream vggt.models.aggregator.Aggregator.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "vggtcd/vggt/cost.h"
#include "vggtcd/vggt/patch_embed.h"

namespace vggtcd {

// What the heads read: the tokens after four of the layers, per token the C channels after frame
// attention followed by the C after global attention.
struct AggregatedTokens {
  int64_t frames = 0;
  int64_t grid_height = 0, grid_width = 0;  // patches
  int64_t special = 0;                      // tokens in front of a frame's patches; 0 is the camera
  int64_t channels = 0;                     // 2C
  std::array<Buffer, 4> layers;             // f32 [frames, special + patches, 2C]

  int64_t tokens() const { return special + grid_height * grid_width; }
  Rows frame(size_t layer, int64_t frame_index) const {
    return Rows(DType::kF32, layers[layer], channels).at(frame_index * tokens());
  }
};

class Aggregator {
 public:
  // scope: aggregator.
  Aggregator(const WeightScope& scope, const VggtConfig& config, ProductTypes types);

  // after_block is called after each block of the ViT, of frame and of global attention with its
  // stage.
  AggregatedTokens forward(const ImageBatch& images, const Trace& trace,
                           const std::function<void(VggtStage)>& after_block) const;

 private:
  void insert_special_tokens(const AggregatedTokens& shape, const Rows& x) const;

  VggtConfig config_;
  DType compute_;
  PatchEmbed patch_embed_;
  std::vector<float> first_special_, other_special_;  // [1 + registers, C]: of frame 0, of others
  std::vector<Block> frame_blocks_, global_blocks_;
};

}  // namespace vggtcd
