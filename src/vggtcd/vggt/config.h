// SPDX-License-Identifier: Apache-2.0
// VggtConfig: the sizes of a VGGT network. What tensor shapes tell is read from them; what they
// cannot tell comes from the checkpoint's metadata key "config", else from VGGT-1B.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "vggtcd/nn/weights.h"

namespace vggtcd {

struct VggtConfig {
  // From shapes.
  int64_t patch_size = 0;       // px
  int64_t position_grid = 0;    // the stored position embedding is a square grid of this side
  int64_t channels = 0;         // C
  int64_t register_tokens = 0;  // of the aggregator, beside one camera token
  int64_t vit_register_tokens = 0;
  int vit_depth = 0;
  int depth = 0;           // frame blocks, and as many global blocks
  int64_t mlp_hidden = 0;  // of the MLPs of ViT and aggregator
  int camera_depth = 0;    // blocks of the camera head's trunk
  int64_t camera_hidden = 0;
  // Of the depth head, 0 without one; the point head's are the same.
  int64_t dpt_features = 0;
  std::array<int64_t, 4> dpt_channels{};
  std::array<int64_t, 2> dpt_output_channels{};  // of output_conv1 and output_conv2.0
  // From metadata or VGGT-1B.
  int64_t heads = 16;
  int64_t vit_heads = 16;
  int64_t camera_heads = 16;
  int camera_iterations = 4;
  std::array<int, 4> dpt_layers = {4, 11, 17, 23};
  double rope_frequency = 100.0;

  int64_t special_tokens() const { return 1 + register_tokens; }
};

// config_json: the text of the metadata key "config", empty if the checkpoint has none. Throws
// Error{kWeights} for a store that does not hold a VGGT, and for a config that contradicts it.
VggtConfig read_config(const WeightStore& store, const std::string& config_json);

// What the network cannot be told and must not guess.
inline constexpr float kVitEps = 1e-6f;           // LayerNorm in the ViT: blocks and final norm
inline constexpr float kEps = 1e-5f;              // LayerNorm everywhere else
inline constexpr float kAdaptiveNormEps = 1e-6f;  // the camera head's affine-free norm
inline constexpr std::array<float, 3> kImageMean = {0.485f, 0.456f, 0.406f};
inline constexpr std::array<float, 3> kImageStd = {0.229f, 0.224f, 0.225f};

}  // namespace vggtcd
