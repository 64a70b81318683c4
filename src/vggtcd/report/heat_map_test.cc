// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/report/heat_map.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <vector>

#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

TEST(HeatColor, RunsFromBlueOverGreenAndYellowToRed) {
  const auto blue = heat_color(0), green = heat_color(1.0f / 3), yellow = heat_color(2.0f / 3),
             red = heat_color(1);
  EXPECT_GT(blue[2], blue[0] + 100);
  EXPECT_GT(green[1], std::max(green[0], green[2]) + 50);
  EXPECT_GT(std::min(yellow[0], yellow[1]), yellow[2] + 100);
  EXPECT_GT(red[0], std::max(red[1], red[2]) + 100);
  EXPECT_EQ(heat_color(7.0f), red);
}

TEST(RenderOverlay, KeepsThePhotoAndColoursOnlyPixelsWithEvidence) {
  const int height = 2, width = 2;
  const std::vector<uint8_t> rgb(12, 100);
  const std::vector<float> score = {0.0f, 2.0f, std::numeric_limits<float>::quiet_NaN(), 1.0f};
  const Image image = render_overlay(rgb, score, height, width, {1.0, 2.0});
  constexpr int kZoom = 180;  // 2 px become the smallest panel, 360 px
  ASSERT_EQ(image.width, 2 * kZoom * width + 4);
  ASSERT_GT(image.height, kZoom * height);
  const int heat = image.width - kZoom * width;
  EXPECT_EQ(image.pixel(0, 0)[0], 100);
  EXPECT_EQ(image.pixel(2 * kZoom - 1, 2 * kZoom - 1)[2], 100);
  EXPECT_GT(image.pixel(heat, 0)[2], image.pixel(heat, 0)[0]);                  // static: blue
  EXPECT_GT(image.pixel(heat + kZoom, 0)[0], image.pixel(heat + kZoom, 0)[2]);  // at the bound: red
  const uint8_t* unknown = image.pixel(heat, kZoom);
  EXPECT_EQ(unknown[0], unknown[1]);
  EXPECT_EQ(unknown[1], unknown[2]);
}

TEST(RenderOverlay, RefusesMismatchedSizes) {
  const std::vector<uint8_t> rgb(12, 100);
  const std::vector<float> score(3, 0.0f);
  EXPECT_THROW(render_overlay(rgb, score, 2, 2, {1.0, 2.0}), Error);
}

}  // namespace
}  // namespace vggtcd
