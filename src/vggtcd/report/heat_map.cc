// SPDX-License-Identifier: Apache-2.0
// The colours of change: blue (static), green, yellow, red, and each photo beside its heat map.
#include "vggtcd/report/heat_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

constexpr int kGap = 4;            // px between the photo and its heat map
constexpr int kLegendHeight = 34;  // px below them
constexpr double kFontScale = 0.4;
constexpr int kMinPanelWidth =
    360;  // px: smaller photos are enlarged so that the legend can be read

cv::Scalar grey(int level) { return cv::Scalar::all(level); }

void draw_text(cv::Mat& canvas, const std::string& text, int center_x, int baseline_y) {
  int baseline = 0;
  const cv::Size size = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, kFontScale, 1, &baseline);
  const int x = std::clamp(center_x - size.width / 2, 2, std::max(2, canvas.cols - size.width - 2));
  cv::putText(canvas, text, {x, baseline_y}, cv::FONT_HERSHEY_SIMPLEX, kFontScale, grey(225), 1,
              cv::LINE_AA);
}

// A colour bar from 0 to the bound with the threshold marked, and what grey means.
void draw_legend(cv::Mat& canvas, int left, int top, int width, const HeatScale& scale) {
  const int bar_left = left + 8, bar_width = std::max(1, width - 16);
  for (int x = 0; x < bar_width; ++x) {
    const auto color = heat_color(static_cast<float>(x) / static_cast<float>(bar_width));
    cv::line(canvas, {bar_left + x, top + 4}, {bar_left + x, top + 13},
             cv::Scalar(color[0], color[1], color[2]));
  }
  const int threshold_x =
      bar_left + static_cast<int>(std::lround(bar_width * scale.threshold_u / scale.bound_u));
  cv::line(canvas, {threshold_x, top + 1}, {threshold_x, top + 16}, grey(255), 2);
  draw_text(canvas, "0", bar_left, top + 29);
  draw_text(canvas, fmt::format("changed > {:.3g}", scale.threshold_u), threshold_x, top + 29);
  draw_text(canvas, fmt::format(">= {:.3g}", scale.bound_u), bar_left + bar_width, top + 29);
}

}  // namespace

std::array<uint8_t, 3> heat_color(float fraction) {
  constexpr std::array<std::array<float, 3>, 4> kStops = {
      {{32, 70, 200}, {40, 170, 90}, {245, 215, 50}, {215, 35, 30}}};
  const float position = 3.0f * std::clamp(fraction, 0.0f, 1.0f);
  const size_t stop = std::min<size_t>(2, static_cast<size_t>(position));
  const float weight = position - static_cast<float>(stop);
  std::array<uint8_t, 3> color{};
  for (size_t c = 0; c < 3; ++c) {
    const float value = kStops[stop][c] + weight * (kStops[stop + 1][c] - kStops[stop][c]);
    color[c] = static_cast<uint8_t>(std::lround(value));
  }
  return color;
}

int overlay_zoom(int width) {
  return std::max(1, (kMinPanelWidth + width - 1) / std::max(1, width));
}

Image render_overlay(std::span<const uint8_t> rgb, std::span<const float> score, int height,
                     int width, const HeatScale& scale) {
  const size_t pixels = static_cast<size_t>(height) * static_cast<size_t>(width);
  check(rgb.size() == 3 * pixels && score.size() == pixels, "render_overlay: sizes");
  check(scale.bound_u > 0, "render_overlay: positive bound");
  const int zoom = overlay_zoom(width);
  const int panel_width = zoom * width, panel_height = zoom * height;
  Image out(2 * panel_width + kGap, panel_height + kLegendHeight);
  cv::Mat canvas(out.height, out.width, CV_8UC3, out.rgb.data());
  canvas.setTo(grey(24));
  const float bound = static_cast<float>(scale.bound_u);
  for (int y = 0; y < panel_height; ++y) {
    for (int x = 0; x < panel_width; ++x) {
      const size_t i = static_cast<size_t>(y / zoom) * static_cast<size_t>(width) +
                       static_cast<size_t>(x / zoom);
      const uint8_t* source = &rgb[3 * i];
      std::copy_n(source, 3, out.pixel(x, y));
      const float luma = 0.299f * source[0] + 0.587f * source[1] + 0.114f * source[2];
      uint8_t* target = out.pixel(panel_width + kGap + x, y);
      if (std::isnan(score[i])) {
        std::fill_n(target, 3, static_cast<uint8_t>(0.45f * luma));
        continue;
      }
      // A quarter of the photo's light shows through, so that shapes stay recognisable.
      const auto color = heat_color(score[i] / bound);
      for (size_t c = 0; c < 3; ++c) {
        target[c] = static_cast<uint8_t>(0.75f * static_cast<float>(color[c]) + 0.25f * luma);
      }
    }
  }
  draw_text(canvas, "grey: no evidence", panel_width / 2, panel_height + 20);
  draw_legend(canvas, panel_width + kGap, panel_height, panel_width, scale);
  return out;
}

}  // namespace vggtcd
