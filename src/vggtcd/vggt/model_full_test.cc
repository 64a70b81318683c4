// SPDX-License-Identifier: Apache-2.0
// VGGT-1B itself, 1.19 billion weights from the recipe, against the reference (label: weights).
#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>
#include <tuple>

#include "tests/support/vggt_parity.h"
#include "tests/support/weight_recipe.h"
#include "vggtcd/core/cpu_features.h"
#include "vggtcd/core/timer.h"
#include "vggtcd/nn/product.h"
#include "vggtcd/vggt/model.h"

namespace vggtcd {
namespace {

// Weights of the recipe go page by page as they are packed.
Vggt full(Precision precision) {
  const testing::RecipeWeights weights(testing::NetworkSizes::vggt_1b(), 7);
  return Vggt::from_tensors(weights.tensors(), weights.config_json(), "recipe",
                            {.precision = precision, .point_head = true}, release_pages);
}

void expect_both_cases(Precision precision, const testing::Limits& limits) {
  const Vggt model = full(precision);
  for (const char* name : {"full_case_s2_140x196.npz", "full_case_s3_70x98.npz"}) {
    SCOPED_TRACE(name);
    const std::string report = testing::expect_parity(model, name, limits);
    if (std::getenv("VGGTCD_VERBOSE") != nullptr) std::cout << name << "\n" << report;
  }
}

// A pass of full size through layers as wide as VGGT-1B's, fewer of each kind: every product that
// the network makes, of photos of 518 x 392.
void run_full_size_pass(Precision precision) {
  testing::NetworkSizes sizes = testing::NetworkSizes::vggt_1b();
  sizes.depth = 4;
  sizes.vit_depth = 1;
  sizes.dpt_layers = {0, 1, 2, 3};
  const testing::RecipeWeights weights(sizes, 7);
  const Vggt model = Vggt::from_tensors(weights.tensors(), weights.config_json(), "recipe",
                                        {.precision = precision, .point_head = true});
  ImageBatch images{2, 392, 518, {}, {}};
  images.pixels.assign(static_cast<size_t>(2 * 3 * 392 * 518), 0.5f);
  model.reconstruct(images);
}

// oneDNN takes its instruction set once in a process, so each level needs one of its own: ctest
// gives every test one.
class FullSizePass : public ::testing::TestWithParam<std::tuple<CpuLevel, Precision>> {};

TEST_P(FullSizePass, RunsNoReferenceImplementation) {
  const auto [level, precision] = GetParam();
  if (level > detected_cpu_level()) GTEST_SKIP() << "this processor does not have it";
  if (!onednn_primitives().empty()) GTEST_SKIP() << "needs a process of its own: use ctest";
  const ScopedCpuLevel here(level);
  run_full_size_pass(precision);  // throws where oneDNN would take reference loops in earnest
  const std::vector<std::string> lines = onednn_primitives();
  size_t products = 0;
  for (const std::string& line : lines) {
    std::cout << line << "\n";
    products += line.starts_with("matmul");
    EXPECT_EQ(line.find(": ref"), std::string::npos) << line;
  }
  // On AVX2 all products are our own kernel's; above it the aggregator's are oneDNN's but where
  // it cannot read weights in bf16.
  if (level == CpuLevel::kAvx2) {
    EXPECT_EQ(products, 0u);
  } else {
    EXPECT_GE(products, 5u);
  }
}

std::string pass_name(const ::testing::TestParamInfo<std::tuple<CpuLevel, Precision>>& pass) {
  return fmt::format("{}_{}", enum_to_string(std::get<0>(pass.param)),
                     enum_to_string(std::get<1>(pass.param)));
}

INSTANTIATE_TEST_SUITE_P(Levels, FullSizePass,
                         ::testing::Values(std::tuple{CpuLevel::kAvx2, Precision::kF32},
                                           std::tuple{CpuLevel::kAvx2, Precision::kBf16Weights},
                                           std::tuple{CpuLevel::kAvx512, Precision::kF32},
                                           std::tuple{CpuLevel::kAvx512, Precision::kBf16Weights},
                                           std::tuple{CpuLevel::kAvx512Bf16, Precision::kBf16}),
                         pass_name);

constexpr int64_t kNeededBytes =
    6'500'000'000;  // recipe 4.8 GB, one layer of each kind packed, pass

#define SKIP_IF_MEMORY_IS_SMALL()                                                         \
  if (available_memory_bytes() < kNeededBytes)                                            \
  GTEST_SKIP() << "needs " << kNeededBytes / 1'000'000 << " MB of memory, available are " \
               << available_memory_bytes() / 1'000'000

TEST(VggtFull, EveryStageEqualsTheReferenceInF32) {
  SKIP_IF_MEMORY_IS_SMALL();
  expect_both_cases(Precision::kF32, testing::f32_limit);
}

TEST(VggtFull, Bf16WeightsStayWithinWhatRoundingExplains) {
  SKIP_IF_MEMORY_IS_SMALL();
  if (!bf16_weights_are_supported()) GTEST_SKIP() << "this processor has no AVX2";
  expect_both_cases(Precision::kBf16Weights, testing::bf16_limit);
}

TEST(VggtFull, Bf16StaysWithinWhatRoundingExplains) {
  SKIP_IF_MEMORY_IS_SMALL();
  if (!bf16_is_fast()) GTEST_SKIP() << "this processor has no AVX512_BF16";
  expect_both_cases(Precision::kBf16, testing::bf16_limit);
}

}  // namespace
}  // namespace vggtcd
