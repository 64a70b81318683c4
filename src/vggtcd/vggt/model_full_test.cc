// SPDX-License-Identifier: Apache-2.0
// VGGT-1B itself, 1.19 billion weights from the recipe, against the reference (label: weights).
#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>

#include "tests/support/vggt_parity.h"
#include "tests/support/weight_recipe.h"
#include "vggtcd/core/timer.h"
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

TEST(VggtFull, Bf16StaysWithinWhatRoundingExplains) {
  SKIP_IF_MEMORY_IS_SMALL();
  if (!bf16_is_fast()) GTEST_SKIP() << "this processor has no AVX512_BF16";
  expect_both_cases(Precision::kBf16, testing::bf16_limit);
}

}  // namespace
}  // namespace vggtcd
