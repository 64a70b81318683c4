// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/vggt/checkpoint.h"

#include <gmock/gmock.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "tests/support/test_files.h"
#include "tests/support/torch_writer.h"
#include "tests/support/vggt_parity.h"
#include "tests/support/weight_recipe.h"
#include "vggtcd/io/safetensors.h"
#include "vggtcd/io/weight_file.h"
#include "vggtcd/vggt/model.h"
#include "vggtcd/vggt/network_tensors.h"

namespace vggtcd {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::RecipeWeights;
namespace fs = std::filesystem;

const RecipeWeights& tiny_weights() {
  static const RecipeWeights weights(testing::NetworkSizes::tiny(), 1);
  return weights;
}

void write_tensors(const fs::path& path, const std::vector<TensorView>& tensors,
                   const std::map<std::string, std::string>& metadata) {
  std::vector<TensorInfo> infos;
  for (const TensorView& tensor : tensors) {
    infos.push_back({tensor.name, tensor.dtype, tensor.shape});
  }
  write_safetensors(path, infos, metadata, [&](size_t i, std::span<std::byte> data) {
    std::ranges::copy(tensors[i].data, data.begin());
  });
}

class Checkpoint : public ::testing::Test {
 protected:
  fs::path write_tiny(const std::vector<TensorView>& tensors) const {
    write_tensors(folder_ / "tiny.safetensors", tensors,
                  {{"config", tiny_weights().config_json()}});
    return folder_ / "tiny.safetensors";
  }
  fs::path convert(WeightPrecision precision) const {
    const fs::path out = folder_ / "converted.safetensors";
    convert_weights(write_tiny(tiny_weights().tensors()), out, {precision});
    return out;
  }
  std::string error_of(const std::function<void()>& action) const {
    try {
      action();
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kWeights) << error.what();
      EXPECT_EQ(std::strchr(error.what(), '\n'), nullptr);
      return error.what();
    }
    return "";
  }

  const TemporaryDirectory folder_;
};

TEST_F(Checkpoint, SafetensorsFileEqualsTheReference) {
  const Vggt network = Vggt::load(write_tiny(tiny_weights().tensors()),
                                  {.precision = Precision::kF32, .point_head = true});
  testing::expect_parity(network, "tiny_case_c_s1_70x70.npz", testing::f32_limit);
}

// The reference's outputs for weights that torch.save wrote in float16, read back from such a file.
TEST_F(Checkpoint, PyTorchFileInHalfPrecisionEqualsTheReference) {
  std::vector<std::vector<uint16_t>> halves;
  std::vector<TensorView> tensors = tiny_weights().tensors();
  for (TensorView& tensor : tensors) {
    std::vector<uint16_t>& half = halves.emplace_back();
    for (int64_t i = 0; i < tensor.numel(); ++i) {
      float value = 0;
      std::memcpy(&value, tensor.data.data() + 4 * i, 4);
      half.push_back(half_from_float(value));
    }
    tensor.dtype = DType::kF16;
    tensor.data = std::as_bytes(std::span(half));
  }
  const fs::path path = folder_ / "model.pt";
  std::ofstream(path, std::ios::binary) << testing::torch_zip_file("model", tensors);

  const WeightFile file = open_weight_file(path);
  EXPECT_EQ(file.format, WeightFormat::kTorchZip);
  const Vggt network = Vggt::from_tensors(file.tensors, tiny_weights().config_json(), "model.pt",
                                          {.precision = Precision::kF32, .point_head = true});
  testing::expect_parity(network, "tiny_case_a_half_weights.npz", testing::f32_limit);
}

TEST_F(Checkpoint, ConvertingRoundsMatricesAndKeepsTheRest) {
  const fs::path out = convert(WeightPrecision::kBF16);
  const WeightFile file = open_weight_file(out);
  EXPECT_EQ(file.metadata.at("config"), tiny_weights().config_json());
  ASSERT_EQ(file.tensors.size(), tiny_weights().tensors().size());
  for (const TensorView& original : tiny_weights().tensors()) {
    const TensorView* converted = file.find(original.name);
    ASSERT_NE(converted, nullptr) << original.name;
    EXPECT_EQ(converted->shape, original.shape);
    const bool matrix = original.name.ends_with(".weight") && original.shape.size() > 1;
    ASSERT_EQ(converted->dtype, matrix ? DType::kBF16 : DType::kF32) << original.name;
    for (int64_t i = 0; i < original.numel(); i += 97) {
      float value = 0;
      std::memcpy(&value, original.data.data() + 4 * i, 4);
      float found = 0;
      if (matrix) {
        uint16_t bits = 0;
        std::memcpy(&bits, converted->data.data() + 2 * i, 2);
        EXPECT_EQ(bits, bfloat16_from_float(value)) << original.name;
      } else {
        std::memcpy(&found, converted->data.data() + 4 * i, 4);
        EXPECT_EQ(found, value) << original.name;
      }
    }
  }
  EXPECT_LT(static_cast<double>(fs::file_size(out)),
            0.51 * static_cast<double>(fs::file_size(folder_ / "tiny.safetensors")));
}

TEST_F(Checkpoint, ConvertingToF32ChangesNoValue) {
  const WeightFile file = open_weight_file(convert(WeightPrecision::kF32));
  for (const TensorView& original : tiny_weights().tensors()) {
    EXPECT_TRUE(std::ranges::equal(file.find(original.name)->data, original.data));
  }
}

TEST_F(Checkpoint, ConvertedBf16FileStaysWithinWhatRoundingExplains) {
  const Vggt network = Vggt::load(convert(WeightPrecision::kBF16),
                                  {.precision = Precision::kF32, .point_head = true});
  testing::expect_parity(network, "tiny_case_c_s1_70x70.npz", testing::bf16_limit);
}

TEST_F(Checkpoint, ABf16FileIsTheSameNetworkWhetherItsWeightsAreKeptInBf16OrF32) {
  if (!bf16_weights_are_supported()) GTEST_SKIP() << "this processor has no AVX2";
  const fs::path file = convert(WeightPrecision::kBF16);
  const testing::GoldenCase golden(VGGTCD_SOURCE_DIR "/tests/golden/vggt/tiny_case_c_s1_70x70.npz");
  const auto run = [&](Precision precision) {
    return Vggt::load(file, {.precision = precision}).reconstruct(testing::images_of(golden));
  };
  const Prediction in_f32 = run(Precision::kF32), in_bf16 = run(Precision::kBf16Weights);
  // The products are the same ones; on some processors another kernel sums them.
  double difference = 0, norm = 0;
  for (size_t i = 0; i < in_f32.reconstruction.depth.size(); ++i) {
    const double depth = in_f32.reconstruction.depth[i];
    difference += std::pow(in_bf16.reconstruction.depth[i] - depth, 2);
    norm += depth * depth;
  }
  EXPECT_LE(std::sqrt(difference / norm), testing::f32_limit("depth").rel_l2);
}

TEST_F(Checkpoint, ValuesTooLargeForHalfPrecisionAreRefused) {
  const std::vector<float> values = {1.0f, 70000.0f};
  const std::vector<TensorView> tensors = {
      {"a.weight", DType::kF32, {1, 2}, std::as_bytes(std::span(values))}};
  write_tensors(folder_ / "in", tensors, {});
  EXPECT_THAT(
      error_of([&] { convert_weights(folder_ / "in", folder_ / "out", {WeightPrecision::kF16}); }),
      HasSubstr("\"a.weight\""));
  EXPECT_FALSE(fs::exists(folder_ / "out"));
}

TEST_F(Checkpoint, MissingMisshapenAndMisnamedTensorsAreNamed) {
  const auto load = [&](const std::vector<TensorView>& tensors) {
    const fs::path path = write_tiny(tensors);
    return error_of([&] { Vggt::load(path, {.precision = Precision::kF32}); });
  };
  const std::string name = "depth_head.scratch.layer2_rn.weight";
  std::vector<TensorView> tensors = tiny_weights().tensors();
  const auto victim = std::ranges::find(tensors, name, &TensorView::name);
  victim->name = "depth_head.scratch.layer9_rn.weight";
  EXPECT_THAT(load(tensors), HasSubstr(name));
  victim->name = name;
  std::swap(victim->shape[0], victim->shape[1]);
  victim->shape = {victim->shape[0] * victim->shape[1], 3, 3};
  EXPECT_THAT(load(tensors), HasSubstr(name));
  tensors.erase(victim);
  EXPECT_THAT(load(tensors), HasSubstr(name));
}

TEST_F(Checkpoint, InspectionTellsMissingMisshapenAndSuperfluousApart) {
  std::vector<TensorView> tensors = tiny_weights().tensors();
  WeightFile file;
  file.tensors = tensors;
  CheckpointReport whole = inspect_checkpoint(file, "x");
  EXPECT_EQ(whole.sizes.embed_dim, 128);
  EXPECT_EQ(whole.sizes.image_size, 70);
  EXPECT_EQ(whole.sizes.depth, 4);
  for (const CheckpointReport::Module& module : whole.modules) {
    EXPECT_EQ(module.present, module.expected) << module.name;
  }
  EXPECT_THAT(whole.missing, IsEmpty());
  EXPECT_THAT(whole.superfluous, IsEmpty());

  const auto at = [&](const char* name) {
    return std::ranges::find(file.tensors, std::string(name), &TensorView::name);
  };
  at("aggregator.frame_blocks.1.norm1.bias")->name = "aggregator.frame_blocks.1.norm1.offset";
  at("camera_head.token_norm.weight")->shape = {16, 16};
  at("point_head.norm.weight")->name = "track_head.anything";
  const CheckpointReport report = inspect_checkpoint(file, "x");
  EXPECT_THAT(report.missing, ElementsAre("aggregator.frame_blocks.1.norm1.bias [128]",
                                          "point_head.norm.weight [256]"));
  EXPECT_THAT(report.misshapen,
              ElementsAre("camera_head.token_norm.weight: expected [256], found [16, 16]"));
  EXPECT_THAT(report.superfluous, ElementsAre("aggregator.frame_blocks.1.norm1.offset"));
  EXPECT_EQ(report.track_head_tensors, 1u);

  file.tensors.resize(0);
  EXPECT_THAT(error_of([&] { inspect_checkpoint(file, "x"); }), HasSubstr("tensors of VGGT"));
}

}  // namespace
}  // namespace vggtcd
