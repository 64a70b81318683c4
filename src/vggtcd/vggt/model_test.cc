// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/vggt/model.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>

#include "tests/support/vggt_parity.h"
#include "tests/support/weight_recipe.h"

namespace vggtcd {
namespace {

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

TEST(VggtTiny, Bf16StaysWithinWhatRoundingExplains) {
  if (!bf16_is_fast()) GTEST_SKIP() << "this processor has no AVX512_BF16";
  expect_all_cases(tiny(Precision::kBf16), testing::bf16_limit);
}

}  // namespace
}  // namespace vggtcd
