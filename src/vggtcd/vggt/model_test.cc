// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/vggt/model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <iostream>

#include "tests/support/vggt_parity.h"
#include "tests/support/weight_recipe.h"
#include "vggtcd/core/cpu_features.h"
#include "vggtcd/core/parallel.h"

namespace vggtcd {
namespace {

using ::testing::HasSubstr;
using testing::RecipeWeights;

// The network of the tiny cases of tests/golden/vggt.
Vggt tiny(Precision precision) {
  const RecipeWeights weights(testing::NetworkSizes::tiny(), 1);
  return Vggt::from_tensors(weights.tensors(), weights.config_json(), "recipe",
                            {.precision = precision, .point_head = true});
}

// All three cases within the limits; VGGTCD_VERBOSE=1 prints every deviation.
void expect_all_cases(const Vggt& model, const testing::Limits& limits) {
  for (const char* name :
       {"tiny_case_a_s3_70x70.npz", "tiny_case_b_s4_56x84.npz", "tiny_case_c_s1_70x70.npz"}) {
    SCOPED_TRACE(name);
    const std::string report = testing::expect_parity(model, name, limits);
    if (std::getenv("VGGTCD_VERBOSE") != nullptr) std::cout << name << "\n" << report;
  }
}

TEST(VggtTiny, EveryStageEqualsTheReferenceInF32) {
  const Vggt model = tiny(Precision::kF32);
  EXPECT_TRUE(model.superfluous().empty());
  expect_all_cases(model, testing::f32_limit);
}

TEST(VggtTiny, Bf16WeightsStayWithinWhatRoundingExplains) {
  if (!bf16_weights_are_supported()) GTEST_SKIP() << "this processor has no AVX2";
  expect_all_cases(tiny(Precision::kBf16Weights), testing::bf16_limit);
}

TEST(VggtTiny, Bf16StaysWithinWhatRoundingExplains) {
  if (!bf16_is_fast()) GTEST_SKIP() << "this processor has no AVX512_BF16";
  expect_all_cases(tiny(Precision::kBf16), testing::bf16_limit);
}

ImageBatch small_images(int64_t frames) {
  const testing::GoldenCase golden(VGGTCD_SOURCE_DIR "/tests/golden/vggt/tiny_case_b_s4_56x84.npz");
  ImageBatch images = testing::images_of(golden);
  images.frames = frames;
  images.pixels.resize(static_cast<size_t>(frames * 3 * images.height * images.width));
  return images;
}

std::string error_of(const std::function<void()>& action, ErrorCode code) {
  try {
    action();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return "";
}

class VggtPrecision : public ::testing::TestWithParam<Precision> {};

TEST_P(VggtPrecision, BitsDoNotDependOnTheNumberOfThreads) {
  if (GetParam() == Precision::kBf16 && !bf16_is_fast()) {
    GTEST_SKIP() << "this processor has no AVX512_BF16";
  }
  if (GetParam() == Precision::kBf16Weights && !bf16_weights_are_supported()) {
    GTEST_SKIP() << "this processor has no AVX2";
  }
  const ImageBatch images = small_images(4);
  const int before = num_threads();
  std::vector<Prediction> predictions;
  for (const int threads : {1, 2, 3}) {
    set_num_threads(threads);
    predictions.push_back(tiny(GetParam()).reconstruct(images));
  }
  set_num_threads(before);
  for (const Prediction& prediction : predictions) {
    EXPECT_EQ(prediction.pose_enc, predictions[0].pose_enc);
    EXPECT_EQ(prediction.reconstruction.depth, predictions[0].reconstruction.depth);
    EXPECT_EQ(prediction.reconstruction.confidence, predictions[0].reconstruction.confidence);
    EXPECT_EQ(prediction.world_points, predictions[0].world_points);
  }
}

INSTANTIATE_TEST_SUITE_P(All, VggtPrecision,
                         ::testing::Values(Precision::kF32, Precision::kBf16Weights,
                                           Precision::kBf16),
                         [](const auto& test) { return std::string(enum_to_string(test.param)); });

TEST(Vggt, HeadsThatNobodyAskedForAreNeitherNeededNorRun) {
  const std::array<std::string_view, 2> modules{"aggregator", "camera_head"};
  const RecipeWeights weights(testing::NetworkSizes::tiny(), 1, modules);
  const Vggt model = Vggt::from_tensors(weights.tensors(), weights.config_json(), "recipe",
                                        {.precision = Precision::kF32, .depth_head = false});
  const Prediction without = model.reconstruct(small_images(2));
  EXPECT_TRUE(without.world_points.empty());
  EXPECT_EQ(without.pose_enc, tiny(Precision::kF32).reconstruct(small_images(2)).pose_enc);
  for (const float depth : without.reconstruction.depth) ASSERT_EQ(depth, 0);
  EXPECT_THAT(error_of(
                  [&] {
                    Vggt::from_tensors(weights.tensors(), weights.config_json(), "recipe",
                                       {.precision = Precision::kF32});
                  },
                  ErrorCode::kWeights),
              HasSubstr("depth_head."));
}

TEST(Vggt, NeedsEveryTensorAndListsTheSuperfluous) {
  const RecipeWeights weights(testing::NetworkSizes::tiny(), 1);
  std::vector<TensorView> tensors = weights.tensors();
  std::vector<TensorView> more = tensors;
  more.push_back(more.back());
  more.back().name = "aggregator.frame_blocks.0.attn.rotary";
  const Vggt model = Vggt::from_tensors(more, weights.config_json(), "recipe",
                                        {.precision = Precision::kF32, .point_head = true});
  EXPECT_THAT(model.superfluous(), ::testing::ElementsAre("aggregator.frame_blocks.0.attn.rotary"));
  // A missing tensor is missed: a sample of all, and the first of every layer of a stack.
  for (size_t i = 0; i < tensors.size(); ++i) {
    const std::string name = tensors[i].name;
    if (name.ends_with("mask_token")) continue;  // only training needs it
    if (i % 11 != 0 && !name.ends_with("norm1.weight")) continue;
    std::vector<TensorView> fewer = tensors;
    fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(i));
    try {
      Vggt::from_tensors(fewer, weights.config_json(), "recipe",
                         {.precision = Precision::kF32, .point_head = true});
      ADD_FAILURE() << name << " is not missed";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kWeights) << error.what();
    }
  }
}

TEST(Vggt, ACheckpointThatEndsEarlyIsNotASmallerNetwork) {
  const RecipeWeights weights(testing::NetworkSizes::tiny(), 1);
  for (const char* last : {"aggregator.patch_embed.blocks.1.", "camera_head.trunk.3."}) {
    std::vector<TensorView> fewer = weights.tensors();
    std::erase_if(fewer, [&](const TensorView& tensor) { return tensor.name.starts_with(last); });
    EXPECT_THAT(error_of([&] { Vggt::from_tensors(fewer, weights.config_json(), "recipe", {}); },
                         ErrorCode::kWeights),
                HasSubstr("layers in"));
  }
}

TEST(Vggt, ASmallNetworkWithoutItsConfigIsRefused) {
  const RecipeWeights weights(testing::NetworkSizes::tiny(), 1);
  EXPECT_THAT(error_of([&] { Vggt::from_tensors(weights.tensors(), "", "recipe", {}); },
                       ErrorCode::kWeights),
              HasSubstr("metadata key \"config\""));
  EXPECT_THAT(error_of([&] { Vggt::from_tensors(weights.tensors(), "[1]", "recipe", {}); },
                       ErrorCode::kWeights),
              HasSubstr("JSON object"));
  EXPECT_THAT(
      error_of(
          [&] { Vggt::from_tensors(weights.tensors(), R"({"num_heads": "x"})", "recipe", {}); },
          ErrorCode::kWeights),
      HasSubstr("num_heads has the wrong type"));
}

TEST(Vggt, RefusesImagesThatAreNotWholePatches) {
  const Vggt model = tiny(Precision::kF32);
  ImageBatch images{1, 70, 71, std::vector<float>(3 * 70 * 71), {}};
  EXPECT_THAT(error_of([&] { model.reconstruct(images); }, ErrorCode::kInput),
              HasSubstr("multiples of 14, found 1 of 71x70"));
  EXPECT_THAT(error_of([&] { model.reconstruct(ImageBatch{}); }, ErrorCode::kInput),
              HasSubstr("at least one frame"));
}

TEST(Vggt, Bf16IsRefusedWhereTheProcessorHasNone) {
  const ScopedCpuLevel level(std::min(CpuLevel::kAvx2, detected_cpu_level()));
  EXPECT_THAT(error_of([] { tiny(Precision::kBf16); }, ErrorCode::kUsage), HasSubstr("use auto"));
  EXPECT_EQ(tiny(Precision::kAuto).precision(),
            bf16_weights_are_supported() ? Precision::kBf16Weights : Precision::kF32);
}

TEST(Vggt, Bf16WeightsAreRefusedWithoutAvx2) {
  const ScopedCpuLevel level(CpuLevel::kReference);
  EXPECT_THAT(error_of([] { tiny(Precision::kBf16Weights); }, ErrorCode::kUsage),
              HasSubstr("use f32"));
  EXPECT_EQ(resolve_precision(Precision::kAuto), Precision::kF32);
}

TEST(Vggt, WeightsThatAreNotFiniteAreReportedNotReturned) {
  const RecipeWeights weights(testing::NetworkSizes::tiny(), 1);
  std::vector<TensorView> tensors = weights.tensors();
  const std::vector<float> nan(128, NAN);
  for (TensorView& tensor : tensors) {
    if (tensor.name == "aggregator.frame_blocks.0.ls1.gamma") {
      tensor.data = std::as_bytes(std::span(nan));
    }
  }
  const Vggt model =
      Vggt::from_tensors(tensors, weights.config_json(), "recipe", {.precision = Precision::kF32});
  EXPECT_THAT(error_of([&] { model.reconstruct(small_images(1)); }, ErrorCode::kWeights),
              HasSubstr("not finite"));
}

TEST(VggtCost, TenViewsOfTheFullNetworkCountAsTheReferenceDoes) {
  // Counted on the reference's modules: 33.9 TFLOP, of which attention 12.8. Our out_conv runs
  // before the resize instead of after it, which saves 0.09.
  VggtConfig config;
  config.patch_size = 14;
  config.channels = 1024;
  config.register_tokens = config.vit_register_tokens = 4;
  config.vit_depth = config.depth = 24;
  config.mlp_hidden = 4096;
  config.camera_depth = 4;
  config.camera_hidden = 8192;
  config.dpt_features = 256;
  config.dpt_channels = {256, 512, 1024, 1024};
  config.dpt_output_channels = {128, 32};
  const VggtCost cost = cost_of(config, {.frames = 10, .height = 392, .width = 518});
  EXPECT_NEAR(cost.total_flop() * 1e-12, 33.9, 0.15);
  EXPECT_NEAR(cost.attention_flop * 1e-12, 12.8, 0.05);
}

}  // namespace
}  // namespace vggtcd
