// SPDX-License-Identifier: Apache-2.0
// network_tensors: every tensor that a VGGT of given sizes has, by name and shape, in the order of
// the reference's state_dict; to say of a checkpoint what is missing, misshapen or superfluous.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "vggtcd/io/weight_file.h"

namespace vggtcd {

// What decides the names and shapes. Head width is 64, patches are 14 pixels.
struct NetworkSizes {
  int64_t image_size = 518;  // px; the position embedding covers (image_size / 14)^2 patches
  int64_t embed_dim = 1024;
  int64_t depth = 24;      // frame blocks, and as many global blocks
  int64_t vit_depth = 24;  // blocks of the patch embedder
  int64_t dpt_features = 256;
  std::array<int64_t, 4> dpt_out_channels = {256, 512, 1024, 1024};
};

struct NamedShape {
  std::string name;
  std::vector<int64_t> shape;
};

inline constexpr std::array<std::string_view, 4> kNetworkModules = {"aggregator", "camera_head",
                                                                    "point_head", "depth_head"};

// The tensors of these modules, a subset of kNetworkModules.
std::vector<NamedShape> network_tensors(const NetworkSizes& sizes,
                                        std::span<const std::string_view> modules);

// A checkpoint against the network that its own shapes describe.
struct CheckpointReport {
  struct Module {
    std::string_view name;
    int64_t values = 0;   // in tensors of the right name and shape
    size_t expected = 0;  // tensors
    size_t present = 0;   // of the expected, with the right shape
  };
  NetworkSizes sizes;
  std::vector<Module> modules;           // one for each of kNetworkModules
  std::vector<std::string> missing;      // "name [shape]"
  std::vector<std::string> misshapen;    // "name: expected [shape], found [shape]"
  std::vector<std::string> superfluous;  // names; those of track_head, which is known, are not
  size_t track_head_tensors = 0;
};

// Error{kWeights} if the file has no tensors of a VGGT's aggregator at all.
CheckpointReport inspect_checkpoint(const WeightFile& file, const std::string& name);

}  // namespace vggtcd
