// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/scene/confidence.h"

#include <gtest/gtest.h>

#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

Reconstruction with(std::vector<float> depth, std::vector<float> confidence) {
  Reconstruction r;
  r.width = static_cast<int>(depth.size());
  r.height = 1;
  r.views.resize(1);
  r.depth = std::move(depth);
  r.confidence = std::move(confidence);
  return r;
}

TEST(ConfidenceThreshold, IsTheMedianOverPixelsWithDepth) {
  EXPECT_EQ(confidence_threshold(with({1, 1, 1, 0}, {5, 1, 3, 100})), 3.0f);
  EXPECT_EQ(confidence_threshold(with({1, 1, 1, 1}, {5, 1, 3, 4})), 3.5f);
}

TEST(ConfidenceThreshold, KeepsEveryPixelWhenAllAreEquallySure) {
  const float threshold = confidence_threshold(with({1, 1, 1}, {7, 7, 7}));
  EXPECT_LT(threshold, 7.0f);
  EXPECT_GT(threshold, 6.99f);
}

TEST(ConfidenceThreshold, KeepsTheTiedBestHalf) {
  const float threshold = confidence_threshold(with({1, 1, 1}, {1, 7, 7}));
  EXPECT_LT(threshold, 7.0f);
  EXPECT_GT(threshold, 1.0f);
}

TEST(ConfidenceThreshold, RefusesAnEpochWithoutDepth) {
  EXPECT_THROW(confidence_threshold(with({0, 0}, {1, 2})), Error);
}

TEST(ConfidencePercentile, IsThatOfThePixelsWithDepth) {
  EXPECT_EQ(confidence_percentile(with({1, 1, 1, 0}, {5, 1, 3, 100}), 50), 3.0f);
  EXPECT_EQ(confidence_percentile(with({1, 1, 1, 0}, {5, 1, 3, 100}), 25), 2.0f);
  EXPECT_EQ(confidence_percentile(with({1, 1, 1, 1}, {5, 1, 3, 4}), 100), 5.0f);
  EXPECT_THROW(confidence_percentile(with({0, 0}, {1, 2}), 50), Error);
}

}  // namespace
}  // namespace vggtcd
