// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/report/levels.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "vggtcd/core/parallel.h"

namespace vggtcd {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

// The definition, edge by edge.
int level_by_counting(float score, const LevelScale& scale) {
  int level = 0;
  for (int k = 0; k <= LevelScale::kCount; ++k) level += score > scale.edge(k);
  return level;
}

TEST(LevelScale, LevelIsTheNumberOfEdgesBelow) {
  std::mt19937 random(1);
  for (const double threshold : {0.01, 0.0337, 12.7, 1e-5}) {
    const LevelScale scale(threshold, 2.7 * threshold);
    std::uniform_real_distribution<float> any(0.0f, static_cast<float>(5 * threshold));
    for (int i = 0; i < 20000; ++i) {
      const float score = any(random);
      ASSERT_EQ(scale.level(score), level_by_counting(score, scale)) << score << " " << threshold;
    }
  }
}

// The edges are where rounding could go wrong: exactly on them, and one float to either side.
TEST(LevelScale, IsExactAtTheEdges) {
  for (const double threshold : {0.01, 0.3, 7.7e3}) {
    const LevelScale scale(threshold, 2 * threshold);
    for (int k = 0; k <= LevelScale::kCount; ++k) {
      const float edge = scale.edge(k);
      EXPECT_EQ(scale.level(edge), k);
      EXPECT_EQ(scale.level(std::nextafter(edge, INFINITY)), k + 1);
      if (k > 0) {
        EXPECT_EQ(scale.level(std::nextafter(edge, 0.0f)), k);
      }
    }
  }
}

TEST(LevelScale, TheThresholdIsAnEdgeForAnyThreshold) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> any(1e-4, 3.0);
  for (int i = 0; i < 2000; ++i) {
    const double threshold = any(random);
    const LevelScale scale(threshold, 2 * threshold);
    EXPECT_EQ(scale.edge(scale.threshold_level()), static_cast<float>(threshold));
  }
}

TEST(LevelScale, TakesExtremesWithoutOverflow) {
  const LevelScale scale(0.5, 1.0);
  EXPECT_EQ(scale.level(kNan), LevelScale::kNoEvidence);
  EXPECT_EQ(scale.level(INFINITY), LevelScale::kCount + 1);
  EXPECT_EQ(scale.level(-INFINITY), 0);
  EXPECT_EQ(scale.level(0.0f), 0);
  EXPECT_EQ(LevelScale(0.5, 0.0).threshold_level(), 125);  // reaches to twice the threshold
  EXPECT_EQ(LevelScale(0.5, 1e30).threshold_level(), 63);  // or to four times, rounded
}

TEST(CountScores, AgreesWithCountingEachThreshold) {
  std::mt19937 random(3);
  std::exponential_distribution<float> any(9.0f);
  std::vector<float> scores(200001);
  for (size_t i = 0; i < scores.size(); ++i) scores[i] = i % 7 == 0 ? kNan : any(random);
  const LevelScale scale(0.2, 0.4);
  const int before = num_threads();
  for (const int threads : {1, 3}) {
    set_num_threads(threads);
    const ScoreCounts counts = count_scores(scores, scale);
    for (const int k : {0, 1, 60, scale.threshold_level(), 249, 250}) {
      int64_t expected = 0;
      for (const float score : scores) expected += score > scale.edge(k);
      EXPECT_EQ(counts.above[static_cast<size_t>(k)], expected) << "edge " << k;
    }
    EXPECT_EQ(counts.pixels, 200001 - 28572);
  }
  set_num_threads(before);
}

}  // namespace
}  // namespace vggtcd
