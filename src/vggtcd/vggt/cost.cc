// SPDX-License-Identifier: Apache-2.0
// Operation counts and memory of the network; the same layers as block.cc, camera_head.cc,
// dpt_head.cc.
#include "vggtcd/vggt/cost.h"

#include <algorithm>

#include "vggtcd/core/parallel.h"
#include "vggtcd/nn/attention.h"
#include "vggtcd/nn/linear.h"

namespace vggtcd {
namespace {

double product(int64_t rows, int64_t in, int64_t out) {
  return 2.0 * static_cast<double>(rows) * static_cast<double>(in) * static_cast<double>(out);
}

double attention(int64_t sequences, int64_t tokens, int64_t channels) {
  return 2 * product(sequences * tokens, tokens, channels);
}

// The linear layers of one block: qkv, proj, fc1, fc2.
double block_products(int64_t rows, int64_t channels, int64_t hidden) {
  return product(rows, channels, 4 * channels) + 2 * product(rows, channels, hidden);
}

int64_t block_parameters(int64_t channels, int64_t hidden) {
  return 4 * channels * channels + 2 * channels * hidden;
}

// Maps of the DPT head: height and width of the four levels.
struct DptSizes {
  std::array<int64_t, 4> pixels;
  int64_t finest, full;  // after refinenet1, and of the photo
  DptSizes(const VggtConfig& config, int64_t height, int64_t width) {
    const int64_t h = height / config.patch_size, w = width / config.patch_size;
    pixels = {16 * h * w, 4 * h * w, h * w, ((h - 1) / 2 + 1) * ((w - 1) / 2 + 1)};
    finest = 4 * pixels[0];
    full = height * width;
  }
};

double dpt_flop(const VggtConfig& config, const VggtRun& run, int64_t outputs) {
  const DptSizes sizes(config, run.height, run.width);
  const int64_t features = config.dpt_features;
  double flop = 0;
  for (size_t level = 0; level < 4; ++level) {
    const int64_t channels = config.dpt_channels[level];
    flop += product(sizes.pixels[2], 2 * config.channels, channels);
    if (level < 2) flop += product(sizes.pixels[level], channels, channels);  // transposed
    if (level == 3) flop += product(sizes.pixels[3], 9 * channels, channels);
    flop += product(sizes.pixels[level], 9 * channels, features);
    const int convolutions = level == 3 ? 2 : 4;
    flop += convolutions * product(sizes.pixels[level], 9 * features, features);
    flop += product(sizes.pixels[level], features, features);  // out_conv, before the resize
  }
  flop += product(sizes.finest, 9 * features, config.dpt_output_channels[0]);
  flop += product(sizes.full, 9 * config.dpt_output_channels[0], config.dpt_output_channels[1]);
  flop += product(sizes.full, config.dpt_output_channels[1], outputs);
  return static_cast<double>(run.frames) * flop;
}

int64_t dpt_parameters(const VggtConfig& config) {
  const int64_t features = config.dpt_features;
  int64_t parameters = 14 * 9 * features * features + 4 * features * features;
  for (size_t level = 0; level < 4; ++level) {
    const int64_t channels = config.dpt_channels[level];
    parameters += 2 * config.channels * channels + 9 * channels * features;
    if (level != 2) parameters += (level == 0 ? 16 : level == 1 ? 4 : 9) * channels * channels;
  }
  parameters += 9 * features * config.dpt_output_channels[0];
  return parameters + 9 * config.dpt_output_channels[0] * config.dpt_output_channels[1];
}

int64_t tokens_of(const VggtConfig& config, const VggtRun& run) {
  return config.special_tokens() + run.height / config.patch_size * (run.width / config.patch_size);
}

}  // namespace

std::string_view stage_name(VggtStage stage) {
  constexpr std::array<std::string_view, kNumVggtStages> names{
      "patch embed", "frame attention", "global attention", "cameras", "depth", "points"};
  return names[static_cast<size_t>(stage)];
}

double VggtCost::total_flop() const {
  double sum = 0;
  for (const double one : flop) sum += one;
  return sum;
}

VggtCost cost_of(const VggtConfig& config, const VggtRun& run) {
  VggtCost cost;
  const auto at = [&](VggtStage stage) -> double& { return cost.flop[static_cast<size_t>(stage)]; };
  const int64_t c = config.channels, hidden = config.mlp_hidden, s = run.frames;
  const int64_t tokens = tokens_of(config, run), patches = tokens - config.special_tokens();
  const int64_t vit_tokens = patches + 1 + config.vit_register_tokens;
  const auto stack = [&](VggtStage stage, int depth, int64_t sequences, int64_t length,
                         int64_t channels, int64_t mlp) {
    const double one = attention(sequences, length, channels);
    at(stage) += depth * (block_products(sequences * length, channels, mlp) + one);
    cost.attention_flop += depth * one;
  };
  at(VggtStage::kPatchEmbed) = product(s * patches, 3 * config.patch_size * config.patch_size, c);
  stack(VggtStage::kPatchEmbed, config.vit_depth, s, vit_tokens, c, hidden);
  stack(VggtStage::kFrameAttention, config.depth, s, tokens, c, hidden);
  stack(VggtStage::kGlobalAttention, config.depth, 1, s * tokens, c, hidden);
  for (int i = 0; i < config.camera_iterations; ++i) {
    stack(VggtStage::kCameras, config.camera_depth, 1, s, 2 * c, config.camera_hidden);
    at(VggtStage::kCameras) += product(s, 2 * c, 7 * c) + product(s, 9, 3 * c);
  }
  if (run.depth_head) at(VggtStage::kDepth) = dpt_flop(config, run, 2);
  if (run.point_head) at(VggtStage::kPoints) = dpt_flop(config, run, 4);
  return cost;
}

VggtMemory memory_of(const VggtConfig& config, const VggtRun& run) {
  const ProductTypes types = product_types(run.precision);
  const auto size = static_cast<int64_t>(dtype_size(types.compute));
  const auto kept_size = static_cast<int64_t>(dtype_size(types.weights));
  const int64_t c = config.channels, heads = run.depth_head + run.point_head;
  const int64_t rows = run.frames * tokens_of(config, run);
  const int64_t pixels = run.frames * run.height * run.width;
  VggtMemory memory;
  memory.weights =
      (config.vit_depth + 2 * config.depth) * block_parameters(c, config.mlp_hidden) * kept_size +
      config.camera_depth * block_parameters(2 * c, config.camera_hidden) * 4 + 28 * c * c +
      heads * dpt_parameters(config) * kept_size;
  // Through both phases: the photos and what the heads will read.
  const int64_t kept = rows * 4 * 2 * c * 4, photos = pixels * 3 * 4;
  // The aggregator: residual stream, qkv, the attended rows, packed keys and values.
  const AttentionShape global{1, rows, config.heads, c / config.heads};
  const int64_t aggregator =
      rows * c * 4 + rows * 4 * c * size +
      num_threads() * kRowBlock * (c + config.mlp_hidden) * size +
      static_cast<int64_t>(attention_workspace_bytes(global, types.compute == DType::kBF16));
  // The dense heads: results, and the maps of one frame.
  const DptSizes sizes(config, run.height, run.width);
  const int64_t maps = sizes.finest * config.dpt_features * (4 + size) +
                       sizes.pixels[0] * config.dpt_features * (4 + 2 * size) +
                       sizes.full * config.dpt_output_channels[0] * 4;
  const int64_t dense = pixels * 4 * (2 * run.depth_head + 4 * run.point_head) + maps;
  memory.activations = kept + photos + std::max(aggregator, dense);
  return memory;
}

}  // namespace vggtcd
