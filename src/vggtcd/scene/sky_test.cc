// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/scene/sky.h"

#include <gtest/gtest.h>

#include <vector>

namespace vggtcd {
namespace {

constexpr int kWidth = 260, kHeight = 200, kHorizon = 60;

size_t at(int u, int v) { return static_cast<size_t>(v * kWidth + u); }

// A photo of a ground that rises from depth 2 at the bottom to 12 at the horizon, sure of itself by
// 1.5 to 3; above it a depth of 30 with confidence 1.05. Another photo of the ground alone.
Reconstruction outdoors() {
  Reconstruction r;
  r.width = kWidth;
  r.height = kHeight;
  r.views.resize(2);
  r.depth.resize(r.num_pixels());
  r.confidence.resize(r.num_pixels());
  r.color.resize(3 * r.num_pixels());
  for (int frame = 0; frame < 2; ++frame) {
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        const size_t pixel = static_cast<size_t>(frame) * r.pixels_per_frame() + at(u, v);
        const bool sky = frame == 0 && v < kHorizon;
        r.depth[pixel] = sky ? 30.0f : 2 + 10.0f * static_cast<float>(kHeight - v) / kHeight;
        r.confidence[pixel] = sky ? 1.05f : 1.5f + static_cast<float>((7 * u + 3 * v) % 16) / 10;
      }
    }
  }
  return r;
}

TEST(Sky, IsFarUnsureAndInOnePiece) {
  Reconstruction r = outdoors();
  const std::vector<float> before = r.depth;
  EXPECT_EQ(remove_sky(r), static_cast<size_t>(kWidth * kHorizon));
  EXPECT_DOUBLE_EQ(sky_share(r), 0.5 * kHorizon / kHeight);
  for (size_t pixel = 0; pixel < r.num_pixels(); ++pixel) {
    const bool sky = pixel < at(0, kHorizon);
    ASSERT_EQ(r.sky[pixel], sky ? kOpenSky : kNoSky) << pixel;
    ASSERT_EQ(r.depth[pixel], sky ? 0 : before[pixel]) << pixel;
  }
  check_consistent([&] {
    for (View& view : r.views) view.pinhole = {100, 100, 130, 100, kWidth, kHeight};
    return r;
  }());
}

TEST(Sky, WithinWhatThePhotoShowsIsNotOpen) {
  Reconstruction r = outdoors();
  for (size_t pixel = 0; pixel < at(0, kHorizon); ++pixel)
    r.depth[pixel] = 8.8f;  // a white ceiling
  EXPECT_EQ(remove_sky(r), static_cast<size_t>(kWidth * kHorizon));
  EXPECT_EQ(r.sky[0], kSky);
}

TEST(Sky, FollowsItsSurroundingsWhereConfidenceIsNoisy) {
  Reconstruction r = outdoors();
  for (const size_t pixel : {at(5, 5), at(100, 30), at(259, 0)}) r.confidence[pixel] = 1.4f;
  EXPECT_EQ(remove_sky(r), static_cast<size_t>(kWidth * kHorizon));
}

TEST(Sky, LeavesUnsureSurfacesAlone) {
  Reconstruction r = outdoors();
  for (int v = 100; v < 180; ++v) {
    for (int u = 40; u < 200; ++u) r.confidence[at(u, v)] = 1.05f;  // near: leaves, a mirror
  }
  for (int u = 0; u < kWidth; ++u) r.confidence[at(u, 65)] = 1.05f;  // a line: an edge
  for (int v = 70; v < 75; ++v) r.confidence[at(20, v)] = 1.05f;     // specks
  EXPECT_EQ(remove_sky(r), static_cast<size_t>(kWidth * kHorizon));
  EXPECT_GT(r.depth[at(100, 150)], 0);
  EXPECT_GT(r.depth[at(100, 65)], 0);
  EXPECT_GT(r.depth[at(20, 72)], 0);
}

TEST(Sky, IsNotLookedForWhereConfidenceDoesNotTell) {
  for (const bool constant : {false, true}) {
    Reconstruction r = outdoors();
    for (float& c : r.confidence) c = constant ? 1.0f : c / 10;
    EXPECT_EQ(remove_sky(r), 0u);
    EXPECT_TRUE(r.sky.empty());
  }
  Reconstruction none = outdoors();
  none.depth.assign(none.num_pixels(), 0);
  EXPECT_EQ(remove_sky(none), 0u);
}

TEST(Sky, LeavesWithItsFrame) {
  Reconstruction r = outdoors();
  remove_sky(r);
  remove_frames(r, {true, false});
  EXPECT_EQ(r.sky.size(), r.num_pixels());
  EXPECT_EQ(sky_share(r), 0);
}

}  // namespace
}  // namespace vggtcd
