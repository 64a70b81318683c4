// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/scene/stray_depths.h"

#include <gtest/gtest.h>

#include <vector>

namespace vggtcd {
namespace {

// Two photos of 40 x 25 depths between 1 and 2, every fifth pixel without.
Reconstruction ordinary() {
  Reconstruction r;
  r.width = 40;
  r.height = 25;
  r.views.resize(2);
  for (int i = 0; i < 2000; ++i) {
    r.depth.push_back(i % 5 == 0 ? 0.0f : 1 + static_cast<float>(i) / 2000);
  }
  return r;
}

TEST(StrayDepths, KeepsEveryDepthOfAnOrdinaryScene) {
  Reconstruction r = ordinary();
  r.depth[1] = r.depth[42] = 150;     // the sea behind a window
  r.depth[82] = r.depth[83] = 0.02f;  // a leaf before the lens
  r.depth[500] = 9;                   // a gap in a hedge
  const std::vector<float> before = r.depth;
  EXPECT_EQ(drop_stray_depths(r).count(), 0u);
  EXPECT_EQ(r.depth, before);
}

TEST(StrayDepths, DropsWhatIsAHundredTimesBeyondTheRest) {
  for (const float unit : {1.0f, 1e-9f, 1e9f}) {
    Reconstruction r = ordinary();
    for (float& depth : r.depth) depth *= unit;
    r.depth[1] = r.depth[2] = 250 * unit;
    r.depth[3] = 1e20f * unit;
    r.depth[4] = 0.005f * unit;
    const StrayDepths strays = drop_stray_depths(r);
    EXPECT_EQ(strays.too_far, 3u) << unit;
    EXPECT_EQ(strays.too_near, 1u) << unit;
    for (const size_t i : {1u, 2u, 3u, 4u}) EXPECT_EQ(r.depth[i], 0) << unit;
    EXPECT_GT(r.depth[6], 0) << unit;
  }
}

TEST(StrayDepths, DropsAPixelThatIsAloneAtFiveTimes) {
  Reconstruction r = ordinary();
  r.depth[101] = 12;                      // the 99th percentile is just below 2
  r.depth[203] = 0.1f;                    // the 1st above 1
  r.depth[1999] = 12;                     // the last one, in a corner
  r.depth[1000] = 12, r.depth[999] = 12;  // not beside each other: different photos
  const StrayDepths strays = drop_stray_depths(r);
  EXPECT_EQ(strays.too_far, 4u);
  EXPECT_EQ(strays.too_near, 1u);
  for (const size_t i : {101u, 203u, 999u, 1000u, 1999u}) EXPECT_EQ(r.depth[i], 0) << i;
}

TEST(StrayDepths, TwoInAHundredAreAPartOfTheScene) {
  Reconstruction r = ordinary();
  for (size_t i = 1; i < 2000; i += 40) r.depth[i] = r.depth[i + 1] = 1e6f;
  EXPECT_EQ(drop_stray_depths(r).count(), 0u);
}

TEST(StrayDepths, LeavesASingleDepthAndNoDepthAlone) {
  Reconstruction r = ordinary();
  std::ranges::fill(r.depth, 0.0f);
  EXPECT_EQ(drop_stray_depths(r).count(), 0u);
  r.depth[7] = 3;
  EXPECT_EQ(drop_stray_depths(r).count(), 0u);
  EXPECT_EQ(r.depth[7], 3);
}

}  // namespace
}  // namespace vggtcd
