// SPDX-License-Identifier: Apache-2.0
// network_tensors: the tensor list of a VGGT, module by module as upstream builds them.
#include "vggtcd/vggt/network_tensors.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <unordered_map>

#include "vggtcd/core/error.h"
#include "vggtcd/io/quote.h"

namespace vggtcd {
namespace {

constexpr int64_t kPatchSize = 14, kHeadDim = 64, kRegisters = 4, kMlpRatio = 4, kPoseDim = 9;

// Collects the list; the member functions follow the modules of the reference implementation.
class TensorList {
 public:
  std::vector<NamedShape> tensors;

  void tensor(const std::string& name, std::vector<int64_t> shape) {
    tensors.push_back({name, std::move(shape)});
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

// The sizes as the shapes of the file tell them; what is missing is as in VGGT-1B.
NetworkSizes sizes_of(const WeightFile& file) {
  NetworkSizes sizes;
  const auto read = [&](const std::string& name, size_t axis, int64_t& size) {
    const TensorView* tensor = file.find(name);
    constexpr int64_t kMaxSize = 1'000'000;  // larger ones are nonsense and show as misshapen
    if (tensor == nullptr || axis >= tensor->shape.size()) return;
    if (tensor->shape[axis] >= 1 && tensor->shape[axis] <= kMaxSize) size = tensor->shape[axis];
  };
  read("aggregator.patch_embed.patch_embed.proj.weight", 0, sizes.embed_dim);
  int64_t cells = -1;
  read("aggregator.patch_embed.pos_embed", 1, cells);
  if (cells > 1) {
    sizes.image_size = kPatchSize * std::lround(std::sqrt(static_cast<double>(cells - 1)));
  }
  for (const char* head : {"point_head", "depth_head"}) {
    read(fmt::format("{}.scratch.layer1_rn.weight", head), 0, sizes.dpt_features);
    for (size_t i = 0; i < 4; ++i)
      read(fmt::format("{}.projects.{}.weight", head, i), 0, sizes.dpt_out_channels[i]);
  }
  // A stack is as deep as its highest number, so that a gap shows as missing.
  const auto depth_of = [&](std::string_view prefix, int64_t& depth) {
    int64_t highest = -1;
    for (const TensorView& tensor : file.tensors) {
      if (!tensor.name.starts_with(prefix)) continue;
      constexpr int kMaxDepth = 1000;
      int number = -1;
      std::from_chars(tensor.name.data() + prefix.size(), tensor.name.data() + tensor.name.size(),
                      number);
      if (number < kMaxDepth) highest = std::max<int64_t>(highest, number);
    }
    if (highest >= 0) depth = highest + 1;
  };
  depth_of("aggregator.patch_embed.blocks.", sizes.vit_depth);
  depth_of("aggregator.frame_blocks.", sizes.depth);
  return sizes;
}

}  // namespace

std::vector<NamedShape> network_tensors(const NetworkSizes& sizes,
                                        std::span<const std::string_view> modules) {
  for (const std::string_view module : modules) {
    check(std::ranges::find(kNetworkModules, module) != kNetworkModules.end(),
          "network_tensors: a module");
  }
  const auto wanted = [&](std::string_view module) {
    return std::ranges::find(modules, module) != modules.end();
  };
  TensorList list;
  if (wanted("aggregator")) list.aggregator(sizes);
  if (wanted("camera_head")) list.camera_head(sizes);
  if (wanted("point_head")) list.dpt_head("point_head", sizes, 4);
  if (wanted("depth_head")) list.dpt_head("depth_head", sizes, 2);
  return std::move(list.tensors);
}

CheckpointReport inspect_checkpoint(const WeightFile& file, const std::string& name) {
  std::unordered_map<std::string_view, const TensorView*> unclaimed;
  bool any = false;
  for (const TensorView& tensor : file.tensors) {
    unclaimed[tensor.name] = &tensor;
    any = any || tensor.name.starts_with("aggregator.");
  }
  if (!any) {
    throw_error(ErrorCode::kWeights,
                "{}: expected the tensors of VGGT (aggregator...), found {} others{}", name,
                file.tensors.size(),
                file.tensors.empty() ? "" : ", such as " + quote(file.tensors[0].name));
  }
  CheckpointReport report;
  report.sizes = sizes_of(file);
  for (const std::string_view module : kNetworkModules) {
    CheckpointReport::Module& entry = report.modules.emplace_back();
    entry.name = module;
    for (const NamedShape& expected : network_tensors(report.sizes, std::span(&module, 1))) {
      ++entry.expected;
      const auto found = unclaimed.find(expected.name);
      if (found == unclaimed.end()) {
        report.missing.push_back(expected.name + " " + shape_string(expected.shape));
        continue;
      }
      const TensorView& tensor = *found->second;
      if (tensor.shape == expected.shape) {
        ++entry.present;
        entry.values += tensor.numel();
      } else {
        report.misshapen.push_back(fmt::format("{}: expected {}, found {}", expected.name,
                                               shape_string(expected.shape),
                                               shape_string(tensor.shape)));
      }
      unclaimed.erase(found);
    }
  }
  for (const TensorView& tensor : file.tensors) {
    if (!unclaimed.contains(tensor.name)) continue;
    if (tensor.name.starts_with("track_head.")) {
      ++report.track_head_tensors;
    } else {
      report.superfluous.push_back(tensor.name);
    }
  }
  return report;
}

}  // namespace vggtcd
