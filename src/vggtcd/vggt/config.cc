// SPDX-License-Identifier: Apache-2.0
// VggtConfig: sizes from shapes, the rest from metadata.
#include "vggtcd/vggt/config.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

// The shape of a tensor that must have this many dimensions.
const std::vector<int64_t>& shape_of(const WeightScope& scope, std::string_view name, size_t rank,
                                     const std::string& source) {
  const std::vector<int64_t>& shape = scope.shape(name);
  if (shape.size() != rank) {
    throw_error(ErrorCode::kWeights, "{}: expected {} with {} dimensions, found {}", source,
                scope.full_name(name), rank, shape_string(shape));
  }
  return shape;
}

void read_dense_shapes(const WeightScope& head, const std::string& source, VggtConfig& config) {
  const WeightScope scratch = head.at("scratch");
  config.dpt_features = shape_of(scratch, "layer1_rn.weight", 4, source)[0];
  for (size_t level = 0; level < 4; ++level) {
    config.dpt_channels[level] =
        shape_of(head, fmt::format("projects.{}.weight", level), 4, source)[0];
  }
  config.dpt_output_channels[0] = shape_of(scratch, "output_conv1.weight", 4, source)[0];
  config.dpt_output_channels[1] = shape_of(scratch, "output_conv2.0.weight", 4, source)[0];
}

void read_shapes(const WeightStore& store, VggtConfig& config) {
  const WeightScope aggregator = store.root().at("aggregator");
  const WeightScope vit = aggregator.at("patch_embed");
  const std::string& source = store.source();
  const auto& projection = shape_of(vit, "patch_embed.proj.weight", 4, source);
  config.channels = projection[0];
  config.patch_size = projection[3];
  const int64_t cells = shape_of(vit, "pos_embed", 3, source)[1] - 1;
  config.position_grid = std::lround(std::sqrt(static_cast<double>(cells)));
  if (cells < 1 || config.position_grid * config.position_grid != cells) {
    throw_error(ErrorCode::kWeights,
                "{}: expected a square position embedding and one class token, found {}", source,
                shape_string(vit.shape("pos_embed")));
  }
  config.vit_register_tokens = shape_of(vit, "register_tokens", 3, source)[1];
  config.register_tokens = shape_of(aggregator, "register_token", 4, source)[2];
  config.vit_depth = vit.count("blocks");
  config.depth = aggregator.count("frame_blocks");
  config.mlp_hidden = shape_of(vit, "blocks.0.mlp.fc1.bias", 1, source)[0];
  const WeightScope camera = store.root().at("camera_head");
  config.camera_depth = camera.count("trunk");
  config.camera_hidden = shape_of(camera, "trunk.0.mlp.fc1.bias", 1, source)[0];
  const WeightScope dense = store.root().at(
      store.root().contains("depth_head.norm.weight") ? "depth_head" : "point_head");
  if (dense.contains("norm.weight")) read_dense_shapes(dense, source, config);
}

// The depths that a checkpoint must have: a shorter stack is a damaged file, not a smaller network.
struct Depths {
  int depth = 24, vit_depth = 24, camera_depth = 4;  // VGGT-1B
};

void read_metadata(const std::string& text, const std::string& source, VggtConfig& config,
                   Depths& expected) {
  if (text.empty()) return;
  const auto json = nlohmann::json::parse(text, nullptr, false);
  if (!json.is_object()) {
    throw_error(ErrorCode::kWeights, "{}: expected a JSON object as metadata \"config\"", source);
  }
  const auto read = [&](const char* key, auto& value) {
    const auto found = json.find(key);
    if (found == json.end()) return;
    try {
      found->get_to(value);
    } catch (const nlohmann::json::exception&) {
      throw_error(ErrorCode::kWeights, "{}: metadata \"config\": {} has the wrong type", source,
                  key);
    }
  };
  read("depth", expected.depth);
  read("vit_depth", expected.vit_depth);
  read("camera_trunk_depth", expected.camera_depth);
  read("num_heads", config.heads);
  read("vit_num_heads", config.vit_heads);
  read("camera_num_heads", config.camera_heads);
  read("camera_num_iterations", config.camera_iterations);
  read("dpt_layers", config.dpt_layers);
  read("rope_freq", config.rope_frequency);
}

// Heads of 64 or 128 channels are what VGGT has and attention is written for.
void check_heads(const std::string& source, const char* what, int64_t channels, int64_t heads) {
  const bool valid =
      heads > 0 && channels % heads == 0 && (channels / heads == 64 || channels / heads == 128);
  if (!valid) {
    throw_error(ErrorCode::kWeights,
                "{}: {}: {} channels do not make {} heads of 64 or 128; a network other than "
                "VGGT-1B needs the metadata key \"config\"",
                source, what, channels, heads);
  }
}

void check_depth(const std::string& source, const char* stack, int expected, int found) {
  if (expected == found) return;
  throw_error(ErrorCode::kWeights,
              "{}: expected {} layers in {}, found {}; the file is not a complete checkpoint of "
              "VGGT-1B, or of the network that its metadata key \"config\" describes",
              source, expected, stack, found);
}

}  // namespace

VggtConfig read_config(const WeightStore& store, const std::string& config_json) {
  VggtConfig config;
  Depths expected;
  read_shapes(store, config);
  read_metadata(config_json, store.source(), config, expected);
  check_heads(store.source(), "num_heads", config.channels, config.heads);
  check_heads(store.source(), "vit_num_heads", config.channels, config.vit_heads);
  check_heads(store.source(), "camera_num_heads", 2 * config.channels, config.camera_heads);
  check_depth(store.source(), "aggregator.frame_blocks", expected.depth, config.depth);
  check_depth(store.source(), "aggregator.patch_embed.blocks", expected.vit_depth,
              config.vit_depth);
  check_depth(store.source(), "camera_head.trunk", expected.camera_depth, config.camera_depth);
  int previous = -1;
  for (const int layer : config.dpt_layers) {
    if (layer <= previous || layer >= config.depth) {
      throw_error(ErrorCode::kWeights,
                  "{}: the heads read aggregator layers {}, {}, {} and {}, found {} layers",
                  store.source(), config.dpt_layers[0], config.dpt_layers[1], config.dpt_layers[2],
                  config.dpt_layers[3], config.depth);
    }
    previous = layer;
  }
  if (previous != config.depth - 1) {
    throw_error(ErrorCode::kWeights,
                "{}: the camera head reads the last aggregator layer: expected {} as last of "
                "dpt_layers, found {}",
                store.source(), config.depth - 1, previous);
  }
  if (config.camera_iterations < 1 || config.camera_iterations > 100 ||
      !(config.rope_frequency > 1)) {
    throw_error(ErrorCode::kWeights,
                "{}: metadata \"config\": expected 1 to 100 camera_num_iterations and rope_freq > "
                "1, found {} and {}",
                store.source(), config.camera_iterations, config.rope_frequency);
  }
  return config;
}

}  // namespace vggtcd
