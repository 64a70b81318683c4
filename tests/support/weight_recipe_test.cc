// SPDX-License-Identifier: Apache-2.0
#include "tests/support/weight_recipe.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <bit>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>

#include "vggtcd/core/splitmix64.h"

namespace vggtcd::testing {
namespace {

nlohmann::json golden(const std::string& file) {
  std::ifstream stream(std::string(VGGTCD_SOURCE_DIR "/tests/golden/weight_recipe/") + file);
  return nlohmann::json::parse(stream);
}

uint64_t hex(const nlohmann::json& text) {
  return std::stoull(text.get<std::string>(), nullptr, 16);
}

std::vector<float> make(const nlohmann::json& entry) {
  const TensorSpec spec{entry["name"], entry["shape"].get<std::vector<int64_t>>()};
  int64_t count = 1;
  for (const int64_t n : spec.shape) count *= n;
  std::vector<float> values(static_cast<size_t>(count));
  fill_by_recipe(spec, entry["seed"], values.data());
  return values;
}

TEST(WeightRecipe, HashesHaveTheirPublishedValues) {
  const nlohmann::json vectors = golden("recipe_vectors.json");
  for (const auto& [x, value] : vectors["splitmix64"].items())
    EXPECT_EQ(splitmix64(std::stoull(x)), hex(value));
  for (const auto& [text, value] : vectors["fnv1a64"].items()) EXPECT_EQ(fnv1a64(text), hex(value));
}

TEST(WeightRecipe, ElementsHaveTheExpectedBits) {
  const nlohmann::json vectors = golden("recipe_vectors.json");
  for (const nlohmann::json& element : vectors["elements"]) {
    const float value = make(element)[element["index"].get<size_t>()];
    EXPECT_EQ(std::bit_cast<uint32_t>(value), hex(element["value_bits"])) << element;
  }
}

TEST(WeightRecipe, WholeTensorsHaveTheExpectedChecksum) {
  const nlohmann::json vectors = golden("recipe_vectors.json");
  for (const nlohmann::json& tensor : vectors["tensors"]) {
    const std::vector<float> values = make(tensor);
    const uLong crc = crc32_z(0, reinterpret_cast<const Bytef*>(values.data()), values.size() * 4);
    EXPECT_EQ(crc, hex(tensor["crc32_of_little_endian_f32"])) << tensor;
  }
}

// names.json was made from the reference's own list of tensors: per group of tensors their number,
// the number of values, and a CRC-32 over the lines "name d0 d1 ...\n" in state_dict order.
void expect_names(const NetworkSizes& sizes, const nlohmann::json& groups) {
  struct Group {
    int64_t tensors = 0, values = 0;
    uLong crc = 0;
  };
  std::map<std::string, Group> found;
  for (const TensorSpec& spec : network_tensors(sizes, kNetworkModules)) {
    const size_t first = spec.name.find('.');
    const bool aggregator = spec.name.starts_with("aggregator.");
    Group& group = found[spec.name.substr(0, aggregator ? spec.name.find('.', first + 1) : first)];
    std::string line = spec.name;
    int64_t count = 1;
    for (const int64_t n : spec.shape) {
      line.append(1, ' ').append(std::to_string(n));
      count *= n;
    }
    line += "\n";
    ++group.tensors;
    group.values += count;
    group.crc = crc32_z(group.crc, reinterpret_cast<const Bytef*>(line.data()), line.size());
  }
  EXPECT_EQ(found.size(), groups.size());
  for (const auto& [name, expected] : groups.items()) {
    EXPECT_EQ(found[name].tensors, expected["tensors"]) << name;
    EXPECT_EQ(found[name].values, expected["values"]) << name;
    EXPECT_EQ(found[name].crc, hex(expected["crc32"])) << name;
  }
}

TEST(WeightRecipe, NamesAndShapesOfTheTinyNetworkAreTheReferences) {
  expect_names(NetworkSizes::tiny(), golden("names.json")["tiny"]);
}

TEST(WeightRecipe, NamesAndShapesOfTheFullNetworkAreTheReferences) {
  expect_names(NetworkSizes::vggt_1b(), golden("names.json")["vggt_1b"]);
}

TEST(WeightRecipe, ConfigIsJsonWithTheSizes) {
  const auto config = nlohmann::json::parse(network_config_json(NetworkSizes::vggt_1b()));
  EXPECT_EQ(config["embed_dim"], 1024);
  EXPECT_EQ(config["dpt_layers"], (std::vector<int>{4, 11, 17, 23}));
}

// The checksum over all values of the tiny network as the reference's weights file has them.
TEST(WeightRecipe, AllTinyTensorsTogetherHaveTheExpectedChecksum) {
  const RecipeWeights weights(NetworkSizes::tiny(), 1);
  uLong crc = 0;
  for (const TensorView& tensor : weights.tensors()) {
    EXPECT_EQ(reinterpret_cast<uintptr_t>(tensor.data.data()) % 64, 0u);
    ASSERT_EQ(tensor.data.size(), static_cast<size_t>(tensor.numel()) * 4);
    crc = crc32_z(crc, reinterpret_cast<const Bytef*>(tensor.data.data()), tensor.data.size());
  }
  EXPECT_EQ(crc, hex(golden("names.json")["tiny_values_crc32"]));
}

TEST(WeightRecipe, OnlyTheModulesAskedForAreMade) {
  constexpr std::array<std::string_view, 1> kModules = {"depth_head"};
  const RecipeWeights weights(NetworkSizes::tiny(), 1, kModules);
  EXPECT_EQ(weights.tensors().size(), 62u);
  for (const TensorView& tensor : weights.tensors())
    EXPECT_TRUE(tensor.name.starts_with("depth_head.")) << tensor.name;
}

}  // namespace
}  // namespace vggtcd::testing
