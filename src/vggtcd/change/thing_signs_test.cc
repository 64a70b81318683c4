// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/change/thing_signs.h"

#include <gtest/gtest.h>

#include <vector>

#include "vggtcd/scene/sky.h"

namespace vggtcd {
namespace {

constexpr int kWidth = 320, kHeight = 100;  // squares of 5 x 5 must fit in

// Two photos of a wall.
Reconstruction wall() {
  Reconstruction r;
  r.width = kWidth;
  r.height = kHeight;
  r.views.resize(2);
  r.depth.assign(r.num_pixels(), 3);
  return r;
}

std::vector<uint32_t> rectangle(int frame, int left, int top, int width, int height) {
  std::vector<uint32_t> pixels;
  for (int v = top; v < top + height; ++v) {
    for (int u = left; u < left + width; ++u) {
      pixels.push_back(static_cast<uint32_t>((frame * kHeight + v) * kWidth + u));
    }
  }
  return pixels;
}

TEST(AddBody, IsWhatASquareFitsInto) {
  std::vector<uint32_t> members = rectangle(0, 100, 20, 14, 24);     // 10 x 20 are left
  const std::vector<uint32_t> strip = rectangle(1, 50, 30, 200, 4);  // nothing
  members.insert(members.end(), strip.begin(), strip.end());
  ThingSigns signs;
  add_body(wall(), members, signs);
  EXPECT_EQ(signs.photos, 2);
  EXPECT_EQ(signs.photos_with_body, 1);
  EXPECT_DOUBLE_EQ(signs.body, 200.0 / (14 * 24 + 800));
  EXPECT_EQ(signs.at_edge, 0);
}

TEST(AddBody, TheBorderOfThePhotoEndsAThing) {
  ThingSigns signs;
  add_body(wall(), rectangle(1, 0, 0, kWidth, kHeight), signs);
  EXPECT_DOUBLE_EQ(signs.body, (kWidth - 4.0) * (kHeight - 4) / (kWidth * kHeight));
}

TEST(AddBody, EdgesAreStepsInDepthAndUnknownDepthButNotTheSky) {
  const auto at_edge = [](float depth_beside, uint8_t sky) {
    Reconstruction r = wall();
    r.sky.assign(r.num_pixels(), kNoSky);
    for (const uint32_t pixel : rectangle(0, 110, 0, kWidth - 110, kHeight)) {
      r.depth[pixel] = depth_beside;
      r.sky[pixel] = sky;
    }
    ThingSigns signs;
    add_body(r, rectangle(0, 100, 20, 10, 20), signs);
    return signs.at_edge;
  };
  EXPECT_EQ(at_edge(3.1f, kNoSky), 0);
  EXPECT_DOUBLE_EQ(at_edge(3.3f, kNoSky), 0.2);  // two of ten columns
  EXPECT_DOUBLE_EQ(at_edge(0, kNoSky), 0.2);
  EXPECT_EQ(at_edge(0, kOpenSky), 0);
}

// What the regions of docs/numerics.md looked like: their medians.
constexpr ThingSigns kThing{.pixel_confidence = 0.91,
                            .seen_through = 0.1,
                            .called_changed = 0.96,
                            .photos = 20,
                            .body = 0.5,
                            .at_edge = 0.25};
constexpr ThingSigns kSpecks{.pixel_confidence = 0.7,
                             .seen_through = 0.0,
                             .called_changed = 0.85,
                             .photos = 4,
                             .body = 0.02,
                             .at_edge = 0.8};

TEST(ThingProbability, TellsThingsFromSpecks) {
  EXPECT_GT(thing_probability(kThing), 0.95);
  EXPECT_LT(thing_probability(kSpecks), 0.2);
}

TEST(ThingProbability, FallsWithEverySign) {
  const auto falls = [](const ThingSigns& worse, const char* sign) {
    EXPECT_LT(thing_probability(worse), thing_probability(kThing)) << sign;
  };
  ThingSigns worse = kThing;
  worse.pixel_confidence -= 0.1, falls(worse, "pixel_confidence");
  worse = kThing, worse.seen_through += 0.2, falls(worse, "seen_through");
  worse = kThing, worse.called_changed -= 0.2, falls(worse, "called_changed");
  worse = kThing, worse.photos = 2, falls(worse, "photos");
  worse = kThing, worse.body = 0, falls(worse, "body");
  worse = kThing, worse.at_edge = 1, falls(worse, "at_edge");
}

}  // namespace
}  // namespace vggtcd
