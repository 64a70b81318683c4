// SPDX-License-Identifier: Apache-2.0
// The weight recipe: the tensor list of a VGGT by its sizes, and the hash that fills it.
#include "tests/support/weight_recipe.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/mman.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <new>
#include <numeric>

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"

namespace vggtcd::testing {
namespace {

constexpr int64_t kPatchSize = 14, kHeadDim = 64, kRegisters = 4, kMlpRatio = 4, kPoseDim = 9;

// Collects specs; the member functions follow the modules of the reference implementation.
class SpecList {
 public:
  std::vector<TensorSpec> specs;

  void tensor(const std::string& name, std::vector<int64_t> shape) {
    specs.push_back({name, std::move(shape)});
  }
  void weight_and_bias(const std::string& name, std::vector<int64_t> shape) {
    const int64_t outputs = shape[0];
    tensor(name + ".weight", std::move(shape));
    tensor(name + ".bias", {outputs});
  }
  void norm(const std::string& name, int64_t channels) { weight_and_bias(name, {channels}); }

  void block(const std::string& name, int64_t channels, bool qk_norm) {
    norm(name + ".norm1", channels);
    weight_and_bias(name + ".attn.qkv", {3 * channels, channels});
    if (qk_norm) {
      norm(name + ".attn.q_norm", kHeadDim);
      norm(name + ".attn.k_norm", kHeadDim);
    }
    weight_and_bias(name + ".attn.proj", {channels, channels});
    tensor(name + ".ls1.gamma", {channels});
    norm(name + ".norm2", channels);
    weight_and_bias(name + ".mlp.fc1", {kMlpRatio * channels, channels});
    weight_and_bias(name + ".mlp.fc2", {channels, kMlpRatio * channels});
    tensor(name + ".ls2.gamma", {channels});
  }

  void aggregator(const NetworkSizes& sizes) {
    const int64_t channels = sizes.embed_dim, grid = sizes.image_size / kPatchSize;
    tensor("aggregator.camera_token", {1, 2, 1, channels});
    tensor("aggregator.register_token", {1, 2, kRegisters, channels});
    const std::string vit = "aggregator.patch_embed";
    tensor(vit + ".cls_token", {1, 1, channels});
    tensor(vit + ".pos_embed", {1, 1 + grid * grid, channels});
    tensor(vit + ".register_tokens", {1, kRegisters, channels});
    tensor(vit + ".mask_token", {1, channels});
    weight_and_bias(vit + ".patch_embed.proj", {channels, 3, kPatchSize, kPatchSize});
    for (int64_t i = 0; i < sizes.vit_depth; ++i)
      block(fmt::format("{}.blocks.{}", vit, i), channels, false);
    norm(vit + ".norm", channels);
    for (const char* kind : {"frame", "global"}) {
      for (int64_t i = 0; i < sizes.depth; ++i)
        block(fmt::format("aggregator.{}_blocks.{}", kind, i), channels, true);
    }
  }

  void camera_head(const NetworkSizes& sizes) {
    const int64_t channels = 2 * sizes.embed_dim;
    tensor("camera_head.empty_pose_tokens", {1, 1, kPoseDim});
    for (int i = 0; i < 4; ++i) block(fmt::format("camera_head.trunk.{}", i), channels, false);
    norm("camera_head.token_norm", channels);
    norm("camera_head.trunk_norm", channels);
    weight_and_bias("camera_head.embed_pose", {channels, kPoseDim});
    weight_and_bias("camera_head.poseLN_modulation.1", {3 * channels, channels});
    weight_and_bias("camera_head.pose_branch.fc1", {channels / 2, channels});
    weight_and_bias("camera_head.pose_branch.fc2", {kPoseDim, channels / 2});
  }

  void dpt_head(const std::string& head, const NetworkSizes& sizes, int64_t outputs) {
    const int64_t features = sizes.dpt_features;
    const std::array<int64_t, 4>& channels = sizes.dpt_out_channels;
    norm(head + ".norm", 2 * sizes.embed_dim);
    for (size_t i = 0; i < 4; ++i)
      weight_and_bias(fmt::format("{}.projects.{}", head, i),
                      {channels[i], 2 * sizes.embed_dim, 1, 1});
    weight_and_bias(head + ".resize_layers.0", {channels[0], channels[0], 4, 4});
    weight_and_bias(head + ".resize_layers.1", {channels[1], channels[1], 2, 2});
    weight_and_bias(head + ".resize_layers.3", {channels[3], channels[3], 3, 3});
    const std::string scratch = head + ".scratch";
    for (size_t i = 0; i < 4; ++i)
      tensor(fmt::format("{}.layer{}_rn.weight", scratch, i + 1), {features, channels[i], 3, 3});
    for (int i = 1; i <= 4; ++i) {
      const std::string net = fmt::format("{}.refinenet{}", scratch, i);
      weight_and_bias(net + ".out_conv", {features, features, 1, 1});
      for (int unit = i == 4 ? 2 : 1; unit <= 2; ++unit) {
        for (int conv = 1; conv <= 2; ++conv)
          weight_and_bias(fmt::format("{}.resConfUnit{}.conv{}", net, unit, conv),
                          {features, features, 3, 3});
      }
    }
    weight_and_bias(scratch + ".output_conv1", {features / 2, features, 3, 3});
    weight_and_bias(scratch + ".output_conv2.0", {32, features / 2, 3, 3});
    weight_and_bias(scratch + ".output_conv2.2", {outputs, 32, 1, 1});
  }
};

struct Range {
  double offset, scale;
};

// The rules in order; the first that fits holds. fc2.bias differs per element: `index` chooses.
Range range_of(const TensorSpec& spec, int64_t index) {
  const std::string& name = spec.name;
  const auto rounded = [](double offset, double scale) {
    return Range{static_cast<float>(offset), static_cast<float>(scale)};
  };
  const std::string_view leaf = std::string_view(name).substr(name.rfind('.') + 1);
  const bool weight = leaf == "weight";
  if (name == "camera_head.pose_branch.fc2.bias") {
    constexpr double kOffsets[kPoseDim] = {0, 0, 0, 0, 0, 0, 0.25, 0.25, 0.30};
    return rounded(kOffsets[index], 0.02);
  }
  if (leaf == "gamma") return rounded(0.3, 0.1);
  if (leaf == "bias") return rounded(0, 0.1);
  if (weight && spec.shape.size() == 1) {
    const bool qk_norm = name.ends_with("q_norm.weight") || name.ends_with("k_norm.weight");
    return qk_norm ? rounded(1.5, 0.15) : rounded(1, 0.1);
  }
  if (weight) {
    int64_t fan_in =
        std::accumulate(spec.shape.begin() + 1, spec.shape.end(), int64_t{1}, std::multiplies<>());
    const bool transposed =
        name.ends_with("resize_layers.0.weight") || name.ends_with("resize_layers.1.weight");
    if (transposed) fan_in = spec.shape[0];
    double gain = 1;
    if (name.ends_with("attn.qkv.weight")) gain = 1.5;
    if (name == "camera_head.pose_branch.fc2.weight") gain = 0.05;
    return rounded(0, gain * std::sqrt(3.0 / static_cast<double>(fan_in)));
  }
  return rounded(0, 0.5);
}

constexpr size_t kHugePage = size_t{2} << 20;

int64_t numel(const std::vector<int64_t>& shape) {
  return std::accumulate(shape.begin(), shape.end(), int64_t{1}, std::multiplies<>());
}

}  // namespace

NetworkSizes NetworkSizes::tiny() {
  return {.image_size = 70,
          .embed_dim = 128,
          .num_heads = 2,
          .depth = 4,
          .vit_depth = 2,
          .camera_num_heads = 2,
          .dpt_features = 64,
          .dpt_out_channels = {64, 64, 128, 128},
          .dpt_layers = {0, 1, 2, 3}};
}

NetworkSizes NetworkSizes::vggt_1b() {
  return {.image_size = 518,
          .embed_dim = 1024,
          .num_heads = 16,
          .depth = 24,
          .vit_depth = 24,
          .camera_num_heads = 16,
          .dpt_features = 256,
          .dpt_out_channels = {256, 512, 1024, 1024},
          .dpt_layers = {4, 11, 17, 23}};
}

std::string network_config_json(const NetworkSizes& s) {
  return fmt::format(
      R"({{"img_size": {}, "patch_size": 14, "embed_dim": {}, "depth": {}, "num_heads": {}, )"
      R"("mlp_ratio": 4, "num_register_tokens": 4, "vit_depth": {}, "vit_num_heads": {}, )"
      R"("camera_dim": {}, "camera_num_heads": {}, "camera_trunk_depth": 4, )"
      R"("camera_num_iterations": 4, "dpt_features": {}, "dpt_out_channels": [{}], )"
      R"("dpt_layers": [{}], "has_camera_head": true, "has_depth_head": true, )"
      R"("has_point_head": true, "has_track_head": false}})",
      s.image_size, s.embed_dim, s.depth, s.num_heads, s.vit_depth, s.num_heads, 2 * s.embed_dim,
      s.camera_num_heads, s.dpt_features, fmt::join(s.dpt_out_channels, ", "),
      fmt::join(s.dpt_layers, ", "));
}

std::vector<TensorSpec> tensor_specs(const NetworkSizes& sizes,
                                     std::span<const std::string_view> modules) {
  for (const std::string_view module : modules) {
    check(std::ranges::find(kAllModules, module) != kAllModules.end(), "tensor_specs: a module");
  }
  const auto wanted = [&](std::string_view module) {
    return std::ranges::find(modules, module) != modules.end();
  };
  SpecList list;
  if (wanted("aggregator")) list.aggregator(sizes);
  if (wanted("camera_head")) list.camera_head(sizes);
  if (wanted("point_head")) list.dpt_head("point_head", sizes, 4);
  if (wanted("depth_head")) list.dpt_head("depth_head", sizes, 2);
  return std::move(list.specs);
}

uint64_t splitmix64(uint64_t x) {
  uint64_t z = x + 0x9E3779B97F4A7C15u;
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
  return z ^ (z >> 31);
}

uint64_t fnv1a64(std::string_view text) {
  uint64_t hash = 0xcbf29ce484222325u;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  return hash;
}

void fill_by_recipe(const TensorSpec& spec, uint64_t seed, float* values) {
  constexpr int64_t kGrain = 1 << 18;
  const uint64_t key = fnv1a64(spec.name) ^ splitmix64(seed);
  parallel_for(numel(spec.shape), kGrain, [&](int64_t begin, int64_t end) {
    Range range = range_of(spec, 0);
    const bool per_element = range_of(spec, numel(spec.shape) - 1).offset != range.offset;
    for (int64_t i = begin; i < end; ++i) {
      if (per_element) range = range_of(spec, i);
      const uint64_t bits = splitmix64(key + static_cast<uint64_t>(i)) >> 40;
      const double u = static_cast<double>(static_cast<int64_t>(bits)) * 0x1p-23 - 1.0;
      values[i] = static_cast<float>(range.offset + range.scale * u);
    }
  });
}

void RecipeWeights::Free::operator()(float* memory) const {
  ::operator delete (memory, std::align_val_t{64});
}

RecipeWeights::RecipeWeights(const NetworkSizes& sizes, uint64_t seed,
                             std::span<const std::string_view> modules)
    : config_json_(network_config_json(sizes)) {
  constexpr int64_t kAlignment = 64 / sizeof(float);
  std::vector<TensorSpec> specs = tensor_specs(sizes, modules);
  int64_t size = 0;
  for (const TensorSpec& spec : specs)
    size += (numel(spec.shape) + kAlignment - 1) / kAlignment * kAlignment;
  memory_.reset(static_cast<float*>(
      ::operator new (static_cast<size_t>(size) * sizeof(float), std::align_val_t{64})));
  float* values = memory_.get();
  for (TensorSpec& spec : specs) {
    const int64_t count = numel(spec.shape);
    fill_by_recipe(spec, seed, values);
    tensors_.push_back({std::move(spec.name), DType::kF32, std::move(spec.shape),
                        std::as_bytes(std::span(values, static_cast<size_t>(count)))});
    values += (count + kAlignment - 1) / kAlignment * kAlignment;
  }
}

}  // namespace vggtcd::testing
