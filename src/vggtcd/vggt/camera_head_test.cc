// SPDX-License-Identifier: Apache-2.0
// Block and CameraHead against plain loops in double precision, on weights and inputs so small that
// every LayerNorm's eps decides the result: the golden cases cannot tell 1e-5 from 1e-6 there.
#include "vggtcd/vggt/camera_head.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "tests/support/golden_case.h"
#include "tests/support/weight_recipe.h"
#include "vggtcd/core/splitmix64.h"
#include "vggtcd/nn/reference.h"

namespace vggtcd {
namespace {

using Numbers = std::vector<double>;

// Weights of the small network, some of them scaled.
struct TestWeights {
  explicit TestWeights(const std::vector<std::pair<std::string, float>>& factors) {
    const testing::RecipeWeights recipe(testing::NetworkSizes::tiny(), 1);
    for (const TensorView& tensor : recipe.tensors()) {
      const auto* first = reinterpret_cast<const float*>(tensor.data.data());
      std::vector<float>& copy = values[tensor.name];
      copy.assign(first, first + tensor.numel());
      for (const auto& [part, factor] : factors) {
        if (tensor.name.find(part) == std::string::npos) continue;
        for (float& value : copy) value *= factor;
      }
      views.push_back({tensor.name, tensor.dtype, tensor.shape, std::as_bytes(std::span(copy))});
    }
    config = recipe.config_json();
  }
  std::map<std::string, std::vector<float>> values;
  std::vector<TensorView> views;
  std::string config;
};

// The network's layers as the formulas have them, one frame or token after the other.
struct Naive {
  const std::map<std::string, std::vector<float>>& weights;

  const std::vector<float>& at(const std::string& name) const { return weights.at(name); }

  Numbers linear(const std::string& name, const Numbers& x) const {
    const auto &weight = at(name + ".weight"), &bias = at(name + ".bias");
    const size_t out = bias.size(), in = weight.size() / out, rows = x.size() / in;
    Numbers y(rows * out);
    for (size_t r = 0; r < rows; ++r) {
      for (size_t o = 0; o < out; ++o) {
        double sum = bias[o];
        for (size_t i = 0; i < in; ++i) sum += double{weight[o * in + i]} * x[r * in + i];
        y[r * out + o] = sum;
      }
    }
    return y;
  }

  Numbers norm(const std::string& name, const Numbers& x, size_t channels, double eps) const {
    Numbers y(x.size());
    const float* weight = name.empty() ? nullptr : at(name + ".weight").data();
    const float* bias = name.empty() ? nullptr : at(name + ".bias").data();
    for (size_t r = 0; r < x.size() / channels; ++r) {
      reference::layer_norm_row(static_cast<int64_t>(channels), x.data() + r * channels, weight,
                                bias, eps, y.data() + r * channels);
    }
    return y;
  }

  // One sequence; qk_norm: of frame and global blocks, with their rotary embedding.
  void block(const std::string& name, Numbers& x, size_t channels, size_t heads, bool qk_norm,
             const std::vector<RopePosition>& positions) const {
    const size_t tokens = x.size() / channels, dim = channels / heads;
    const Numbers qkv = linear(name + ".attn.qkv", norm(name + ".norm1", x, channels, 1e-5));
    Numbers attended(x.size());
    for (size_t head = 0; head < heads; ++head) {
      std::array<Numbers, 3> parts;  // q, k, v of this head
      for (size_t part = 0; part < 3; ++part) {
        for (size_t t = 0; t < tokens; ++t) {
          const auto first =
              qkv.begin() + static_cast<std::ptrdiff_t>((t * 3 + part) * channels + head * dim);
          parts[part].insert(parts[part].end(), first, first + static_cast<std::ptrdiff_t>(dim));
        }
      }
      if (qk_norm) {
        parts[0] = norm(name + ".attn.q_norm", parts[0], dim, 1e-5);
        parts[1] = norm(name + ".attn.k_norm", parts[1], dim, 1e-5);
        for (size_t t = 0; t < tokens; ++t) {
          for (size_t part = 0; part < 2; ++part) {
            reference::rope_head(static_cast<int64_t>(dim), positions[t].y, positions[t].x, 100.0,
                                 parts[part].data() + t * dim);
          }
        }
      }
      Numbers scores;
      for (size_t t = 0; t < tokens; ++t) {
        reference::attention_row(static_cast<int64_t>(tokens), static_cast<int64_t>(dim),
                                 parts[0].data() + t * dim, parts[1].data(), parts[2].data(),
                                 static_cast<int64_t>(dim),
                                 attended.data() + t * channels + head * dim,
                                 1 / std::sqrt(static_cast<double>(dim)), scores);
      }
    }
    add(x, at(name + ".ls1.gamma"), linear(name + ".attn.proj", attended));
    Numbers hidden = linear(name + ".mlp.fc1", norm(name + ".norm2", x, channels, 1e-5));
    for (double& value : hidden) value = reference::gelu(value);
    add(x, at(name + ".ls2.gamma"), linear(name + ".mlp.fc2", hidden));
  }

  static void add(Numbers& x, const std::vector<float>& gamma, const Numbers& y) {
    for (size_t i = 0; i < x.size(); ++i) x[i] += gamma[i % gamma.size()] * y[i];
  }

  // pose_tokens [S, C] before token_norm -> raw encodings [S, 9] after the iterations.
  Numbers camera_head(const Numbers& camera_tokens, size_t channels, size_t heads) const {
    const size_t frames = camera_tokens.size() / channels;
    const Numbers tokens = norm("camera_head.token_norm", camera_tokens, channels, 1e-5);
    const Numbers normal = norm("", tokens, channels, 1e-6);
    Numbers pose(frames * 9);
    for (int iteration = 0; iteration < 4; ++iteration) {
      Numbers input = pose;
      const auto& empty = at("camera_head.empty_pose_tokens");
      for (size_t i = 0; iteration == 0 && i < input.size(); ++i) input[i] = empty[i % 9];
      Numbers embedded = linear("camera_head.embed_pose", input);
      for (double& value : embedded) value = reference::silu(value);
      const Numbers modulation = linear("camera_head.poseLN_modulation.1", embedded);
      Numbers x(tokens.size());
      for (size_t i = 0; i < x.size(); ++i) {
        const double* m = modulation.data() + i / channels * 3 * channels + i % channels;
        x[i] = m[2 * channels] * (normal[i] * (1 + m[channels]) + m[0]) + tokens[i];
      }
      for (int layer = 0; layer < 4; ++layer) {
        block("camera_head.trunk." + std::to_string(layer), x, channels, heads, false, {});
      }
      Numbers hidden =
          linear("camera_head.pose_branch.fc1", norm("camera_head.trunk_norm", x, channels, 1e-5));
      for (double& value : hidden) value = reference::gelu(value);
      const Numbers delta = linear("camera_head.pose_branch.fc2", hidden);
      for (size_t i = 0; i < pose.size(); ++i) pose[i] += delta[i];
    }
    return pose;
  }
};

std::vector<float> small_numbers(size_t count, float size) {
  std::vector<float> values(count);
  for (size_t i = 0; i < count; ++i) {
    const uint64_t bits = splitmix64(i) >> 40;
    values[i] = size * (static_cast<float>(bits) * 0x1p-23f - 1.0f);
  }
  return values;
}

void expect_close(const std::vector<float>& found, const Numbers& expected) {
  const std::vector<float> rounded(expected.begin(), expected.end());
  const testing::Deviation d = testing::deviation(found, rounded);
  // f32 arithmetic: 1e-6; a wrong eps: 1e-2 and more.
  EXPECT_LT(d.rel_l2, 2e-5) << d.worst;
}

TEST(Block, MatchesPlainLoopsWhereEpsDecides) {
  const TestWeights weights({{"frame_blocks.0.attn.qkv", 3e-3f}});
  const WeightStore store(weights.views, "test");
  const Block block(store.root().at("aggregator.frame_blocks.0"),
                    {.channels = 128, .heads = 2, .eps = 1e-5f, .qk_norm = true});
  const int64_t tokens = 5 + 2 * 3;
  const TokenPositions positions(5, 2, 3);
  std::vector<float> x = small_numbers(static_cast<size_t>(tokens * 128), 3e-3f);
  Numbers expected(x.begin(), x.end());
  const RopeTable rope(64, 4, 100.0);
  BlockWorkspace workspace(tokens, 128, block.hidden(), DType::kF32);
  block.forward(Rows(x.data(), 128), 1, tokens, &rope, &positions, workspace);
  Naive{weights.values}.block(
      "aggregator.frame_blocks.0", expected, 128, 2, true,
      {{0, 0}, {0, 0}, {0, 0}, {0, 0}, {0, 0}, {1, 1}, {1, 2}, {1, 3}, {2, 1}, {2, 2}, {2, 3}});
  expect_close(x, expected);
}

TEST(CameraHead, MatchesPlainLoopsWhereEpsDecides) {
  const TestWeights weights({{"camera_head.token_norm", 1e-3f},
                             {"camera_head.poseLN_modulation", 3e-3f},
                             {"ls1.gamma", 3e-3f},
                             {"ls2.gamma", 3e-3f},
                             {"camera_head.pose_branch.fc2.bias", -1.0f}});  // negative views
  const WeightStore store(weights.views, "test");
  const VggtConfig config = read_config(store, weights.config);
  const CameraHead head(store.root().at("camera_head"), config);
  AggregatedTokens tokens;
  tokens.frames = 3;
  tokens.grid_height = tokens.grid_width = 1;
  tokens.special = 5;
  tokens.channels = 256;
  const auto values = small_numbers(3 * 6 * 256, 3e-3f);
  tokens.layers[3].reserve(values.size() * sizeof(float));
  std::copy(values.begin(), values.end(), tokens.frame(3, 0).f32());
  Numbers camera_tokens;  // token 0 of every frame
  for (size_t frame = 0; frame < 3; ++frame) {
    const auto first = values.begin() + static_cast<std::ptrdiff_t>(frame * 6 * 256);
    camera_tokens.insert(camera_tokens.end(), first, first + 256);
  }
  std::vector<float> found;
  for (const PoseEncoding& pose : head.forward(tokens, {})) {
    found.insert(found.end(), pose.begin(), pose.end());
  }
  Numbers expected = Naive{weights.values}.camera_head(camera_tokens, 256, 2);
  for (size_t i = 0; i < expected.size(); ++i) {
    if (i % 9 >= 7) expected[i] = std::max(expected[i], 0.0);  // fields of view: relu
  }
  expect_close(found, expected);
}

}  // namespace
}  // namespace vggtcd
