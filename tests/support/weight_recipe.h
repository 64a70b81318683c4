// SPDX-License-Identifier: Apache-2.0
// Weights without a weights file: every value is a pure function of the tensor's name, its shape
// and a seed. The reference network's outputs in tests/golden were computed with these very
// weights.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "vggtcd/core/tensor_view.h"
#include "vggtcd/vggt/network_tensors.h"

namespace vggtcd::testing {

// What decides names and shapes, and what shapes cannot tell.
struct NetworkSizes : vggtcd::NetworkSizes {
  int64_t num_heads = 16;
  int64_t camera_num_heads = 16;
  std::array<int64_t, 4> dpt_layers = {4, 11, 17, 23};

  static NetworkSizes tiny();     // golden cases: seed 1
  static NetworkSizes vggt_1b();  // golden cases: seed 7
};

// The hyper-parameters as the JSON text that weight files carry under the metadata key "config".
std::string network_config_json(const NetworkSizes& sizes);

using TensorSpec = NamedShape;
inline constexpr std::array<std::string_view, 4> kAllModules = kNetworkModules;

// The recipe. `index` counts in C order.
//   key = fnv1a64(name) ^ splitmix64(seed)
//   u = (splitmix64(key + index) >> 40) * 2^-23 - 1, in [-1, 1)
//   value = float(offset + scale * u), offset and scale chosen by name and shape
uint64_t fnv1a64(std::string_view text);
void fill_by_recipe(const TensorSpec& spec, uint64_t seed, float* values);  // in parallel

// Owns f32 tensors made by the recipe. All of VGGT-1B without its track head is 4.8 GB.
class RecipeWeights {
 public:
  RecipeWeights(const NetworkSizes& sizes, uint64_t seed,
                std::span<const std::string_view> modules = kAllModules);
  const std::vector<TensorView>& tensors() const { return tensors_; }  // valid while this lives
  const std::string& config_json() const { return config_json_; }

 private:
  struct Free {
    void operator()(float* memory) const;
  };
  std::unique_ptr<float, Free> memory_;
  std::vector<TensorView> tensors_;
  std::string config_json_;
};

// Writes all modules as safetensors with the metadata key "config", one tensor at a time.
void write_recipe_weights(const NetworkSizes& sizes, uint64_t seed,
                          const std::filesystem::path& path);

}  // namespace vggtcd::testing
