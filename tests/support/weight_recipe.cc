// SPDX-License-Identifier: Apache-2.0
// The weight recipe: the hash that fills the tensors of a VGGT.
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
#include "vggtcd/core/splitmix64.h"
#include "vggtcd/io/safetensors.h"

namespace vggtcd::testing {
namespace {

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
    constexpr double kOffsets[9] = {0, 0, 0, 0, 0, 0, 0.25, 0.25, 0.30};
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

int64_t numel(const std::vector<int64_t>& shape) {
  return std::accumulate(shape.begin(), shape.end(), int64_t{1}, std::multiplies<>());
}

}  // namespace

NetworkSizes NetworkSizes::tiny() {
  NetworkSizes sizes;
  sizes.image_size = 70;
  sizes.embed_dim = 128;
  sizes.depth = 4;
  sizes.vit_depth = 2;
  sizes.dpt_features = 64;
  sizes.dpt_out_channels = {64, 64, 128, 128};
  sizes.num_heads = 2;
  sizes.camera_num_heads = 2;
  sizes.dpt_layers = {0, 1, 2, 3};
  return sizes;
}

NetworkSizes NetworkSizes::vggt_1b() { return {}; }

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
  std::vector<TensorSpec> specs = network_tensors(sizes, modules);
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

void write_recipe_weights(const NetworkSizes& sizes, uint64_t seed,
                          const std::filesystem::path& path) {
  const std::vector<TensorSpec> specs = network_tensors(sizes, kNetworkModules);
  std::vector<TensorInfo> infos;
  for (const TensorSpec& spec : specs) infos.push_back({spec.name, DType::kF32, spec.shape});
  write_safetensors(path, infos, {{"config", network_config_json(sizes)}},
                    [&](size_t i, std::span<std::byte> data) {
                      fill_by_recipe(specs[i], seed, reinterpret_cast<float*>(data.data()));
                    });
}

}  // namespace vggtcd::testing
