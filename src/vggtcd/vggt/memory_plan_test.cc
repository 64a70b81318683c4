// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/vggt/memory_plan.h"

#include <gmock/gmock.h>

#include "tests/support/weight_recipe.h"
#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

using ::testing::HasSubstr;

const VggtConfig& tiny_config() {
  static const VggtConfig config = [] {
    const testing::RecipeWeights weights(testing::NetworkSizes::tiny(), 1);
    return read_config(WeightStore(weights.tensors(), "recipe"), weights.config_json());
  }();
  return config;
}

TEST(MemoryPlan, NeedGrowsWithFramesSizeAndPrecision) {
  const VggtRun run{.frames = 4, .height = 140, .width = 140};
  const auto need = [&](VggtRun changed) { return plan_memory(tiny_config(), changed, 0).needed; };
  VggtRun more = run, larger = run, half = run;
  more.frames = 8;
  larger.height = 280;
  half.precision = Precision::kBf16Weights;
  EXPECT_GT(need(more), need(run));
  EXPECT_GT(need(larger), need(run));
  EXPECT_LT(need(half), need(run));
}

TEST(MemoryPlan, FramesThatFitFitAndOneMoreDoesNot) {
  const VggtRun run{.frames = 100, .height = 140, .width = 140};
  const MemoryPlan all = plan_memory(tiny_config(), run, int64_t{1} << 40);
  EXPECT_TRUE(all.fits());
  EXPECT_EQ(all.frames_that_fit, 100);
  const int64_t available = all.needed - 1;
  const MemoryPlan plan = plan_memory(tiny_config(), run, available);
  EXPECT_FALSE(plan.fits());
  ASSERT_GT(plan.frames_that_fit, 0);
  VggtRun fewer = run;
  fewer.frames = plan.frames_that_fit;
  EXPECT_TRUE(plan_memory(tiny_config(), fewer, available).fits());
  ++fewer.frames;
  EXPECT_FALSE(plan_memory(tiny_config(), fewer, available).fits());
}

TEST(MemoryPlan, OneLineSaysWhatWouldFit) {
  const VggtRun run{.frames = 100, .height = 140, .width = 140};
  const auto error_of = [&](int64_t available) -> std::string {
    try {
      throw_unless_fits(plan_memory(tiny_config(), run, available));
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kMemory);
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(error_of(int64_t{1} << 40), "");
  EXPECT_THAT(error_of(plan_memory(tiny_config(), run, 0).needed - 1), HasSubstr("99 frames"));
  EXPECT_THAT(error_of(0), HasSubstr("not even one frame"));
}

}  // namespace
}  // namespace vggtcd
