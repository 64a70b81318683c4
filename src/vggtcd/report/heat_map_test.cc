// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/report/heat_map.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
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

// The rule of a distance overlay, spelled out: any change of a byte above the legend fails.
TEST(RenderOverlay, PaintsThreeQuartersOfTheHeatOverAQuarterOfTheLight) {
  const int height = 2, width = 2;
  const std::vector<uint8_t> rgb = {10, 20, 30, 250, 120, 0, 0, 0, 0, 255, 255, 255};
  const std::vector<float> score = {0.3f, 2.5f, 1.0f, std::numeric_limits<float>::quiet_NaN()};
  const Image image = render_overlay(rgb, score, height, width, {1.0, 2.0});
  // heat: a fraction f of the bound is 3 f of the way along the four stops.
  const uint8_t expected[4][3] = {{31, 90, 117}, {197, 62, 58}, {106, 144, 52}, {114, 114, 114}};
  for (int y = 0; y < 2 * 180; ++y) {
    for (int x = 0; x < 2 * 180; ++x) {
      const size_t i = static_cast<size_t>(2 * (y / 180) + x / 180);
      for (int c = 0; c < 3; ++c) {
        ASSERT_EQ(image.pixel(x, y)[c], rgb[3 * i + static_cast<size_t>(c)]);
        ASSERT_NEAR(image.pixel(364 + x, y)[c], expected[i][c], 1) << i << " " << c;
      }
    }
  }
}

// 360 times a column of a thousand pixels would be two gigabytes with the heat beside it.
TEST(RenderOverlay, EnlargesThinFramesWithinABound) {
  for (const int height : {1, 400, 1000, 4096, 20000}) {
    const std::vector<uint8_t> rgb(3 * static_cast<size_t>(height), 100);
    const std::vector<float> score(static_cast<size_t>(height), 1.0f);
    const Image image = render_overlay(rgb, score, height, 1, {1.0, 2.0});
    const int zoom = overlay_zoom(1, height);
    EXPECT_GE(zoom, 1);
    EXPECT_LE(image.rgb.size(), size_t{3} * 724 * static_cast<size_t>(std::max(4096, height) + 34))
        << height;
    EXPECT_EQ(image.width, 2 * zoom + 4);
  }
  EXPECT_EQ(overlay_zoom(98, 174), 4);  // photos as they are: by their width
}

TEST(RenderOverlay, RefusesMismatchedSizes) {
  const std::vector<uint8_t> rgb(12, 100);
  const std::vector<float> score(3, 0.0f);
  EXPECT_THROW(render_overlay(rgb, score, 2, 2, {1.0, 2.0}), Error);
}

using Label = ChangeLabel;

TEST(RenderLabelOverlay, ShowsTheAnswersInTheColoursOfThePage) {
  const int height = 1, width = 5;
  std::vector<uint8_t> rgb;
  for (const int light : {0, 100, 200, 255, 80})
    rgb.insert(rgb.end(), 3, static_cast<uint8_t>(light));
  const std::vector<Label> label = {Label::kUnchanged, Label::kRemoved, Label::kAdded,
                                    Label::kUnobserved, Label::kNoEvidence};
  const Image image = render_label_overlay(rgb, label, height, width);
  const int zoom = overlay_zoom(width, height), panel = zoom * width;
  ASSERT_EQ(image.width, 2 * panel + 4);
  // 3/4 of viewer/src/colormap.ts kLabelColors and 1/5 of the light; 1/4 of the light alone.
  const double colors[4][3] = {{164, 173, 186}, {213, 94, 0}, {0, 158, 115}, {92, 97, 106}};
  for (int i = 0; i < width; ++i) {
    const double light = rgb[3 * static_cast<size_t>(i)];
    for (int c = 0; c < 3; ++c) {
      const double expected = i < 4 ? 0.75 * colors[i][c] + 0.2 * light : 0.25 * light;
      for (const int x : {i * zoom, (i + 1) * zoom - 1}) {
        EXPECT_NEAR(image.pixel(panel + 4 + x, zoom - 1)[c], expected, 1) << i;  // truncated
        EXPECT_EQ(image.pixel(x, 0)[c], light);  // read_results takes the photo from here
      }
    }
  }
}

TEST(RenderLabelOverlay, TheLegendHasASwatchOfEachAnswerInItsOrder) {
  const std::vector<uint8_t> rgb(12, 100);
  const Image image = render_label_overlay(rgb, std::vector<Label>(4, Label::kNoEvidence), 2, 2);
  std::vector<std::array<uint8_t, 3>> swatches;  // runs of 12 pixels of one colour, left to right
  for (int x = 364, run = 1; x < image.width; ++x) {
    const uint8_t *at = image.pixel(x, 360 + 16), *left = at - 3;
    run = std::equal(at, at + 3, left) ? run + 1 : 1;
    const std::array<uint8_t, 3> color = {at[0], at[1], at[2]};
    if (run == 12 && color != std::array<uint8_t, 3>{24, 24, 24}) swatches.push_back(color);
  }
  EXPECT_THAT(swatches,
              testing::ElementsAre(label_color(Label::kUnchanged), label_color(Label::kRemoved),
                                   label_color(Label::kAdded), label_color(Label::kUnobserved)));
}

TEST(RenderLabelOverlay, TheGreysStayApartOnAnyPhoto) {
  std::vector<uint8_t> rgb = {0, 0, 0, 255, 255, 255, 255, 255, 255, 0, 0, 0};
  const std::vector<Label> label = {Label::kUnchanged, Label::kUnobserved, Label::kNoEvidence,
                                    Label::kUnobserved};
  const Image image = render_label_overlay(rgb, label, 2, 2);
  const auto red = [&](int x, int y) { return image.pixel(364 + 180 * x, 180 * y)[0]; };
  EXPECT_GT(red(0, 0), red(1, 0));  // the darkest unchanged, the lightest unobserved
  EXPECT_GT(red(1, 1), red(0, 1));  // the darkest unobserved, the lightest no evidence
}

TEST(LabelColor, NoEvidenceHasNone) { EXPECT_THROW(label_color(Label::kNoEvidence), Error); }

}  // namespace
}  // namespace vggtcd
