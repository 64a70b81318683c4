// SPDX-License-Identifier: Apache-2.0
// The colours of change, and each photo beside its change: a heat map of distances, or the answers
// of the votes.
#include "vggtcd/report/heat_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

constexpr int kGap = 4;  // px between the photo and its heat map
constexpr uint8_t kBackground = 24;
constexpr int kLegendHeight = 34;  // px below them
constexpr double kFontScale = 0.4;
constexpr int kMinPanelWidth =
    360;  // px: smaller photos are enlarged so that the legend can be read
constexpr int kMaxEnlargedHeight = 4096;  // px: but not a frame of a few columns to gigabytes

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

// A swatch and the name of each of the four answers.
void draw_label_legend(cv::Mat& canvas, int left, int top) {
  constexpr int kSwatch = 12, kSpace = 16;  // px
  int x = left + 8;
  for (const ChangeLabel label : {ChangeLabel::kUnchanged, ChangeLabel::kRemoved,
                                  ChangeLabel::kAdded, ChangeLabel::kUnobserved}) {
    const auto color = label_color(label);
    cv::rectangle(canvas, cv::Rect(x, top + 10, kSwatch, kSwatch),
                  cv::Scalar(color[0], color[1], color[2]), cv::FILLED);
    x += kSwatch + 4;
    const std::string name(enum_to_string(label));
    cv::putText(canvas, name, {x, top + 20}, cv::FONT_HERSHEY_SIMPLEX, kFontScale, grey(225), 1,
                cv::LINE_AA);
    int baseline = 0;
    x += cv::getTextSize(name, cv::FONT_HERSHEY_SIMPLEX, kFontScale, 1, &baseline).width + kSpace;
  }
}

float luma_of(const uint8_t* rgb) { return 0.299f * rgb[0] + 0.587f * rgb[1] + 0.114f * rgb[2]; }

// The enlarged photo left, right of it what paint(pixel, luma, target) makes of each pixel; the
// rest is the legend's.
template <typename Paint>
Image beside_photo(std::span<const uint8_t> rgb, int height, int width, Paint&& paint) {
  const int zoom = overlay_zoom(width, height);
  const int panel_width = zoom * width, panel_height = zoom * height;
  Image out(2 * panel_width + kGap, panel_height + kLegendHeight);
  std::fill_n(out.rgb.data(), out.rgb.size(), kBackground);
  for (int y = 0; y < panel_height; ++y) {
    for (int x = 0; x < panel_width; ++x) {
      const size_t i = static_cast<size_t>(y / zoom) * static_cast<size_t>(width) +
                       static_cast<size_t>(x / zoom);
      const uint8_t* source = &rgb[3 * i];
      std::copy_n(source, 3, out.pixel(x, y));
      paint(i, luma_of(source), out.pixel(panel_width + kGap + x, y));
    }
  }
  return out;
}

// A colour over the photo's light, so that shapes stay recognisable.
void blend(const std::array<uint8_t, 3>& color, float luma_share, float luma, uint8_t* target) {
  for (size_t c = 0; c < 3; ++c) {
    target[c] = static_cast<uint8_t>(0.75f * static_cast<float>(color[c]) + luma_share * luma);
  }
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

int overlay_zoom(int width, int height) {
  const int wanted = (kMinPanelWidth + width - 1) / std::max(1, width);
  return std::max(1, std::min(wanted, kMaxEnlargedHeight / std::max(1, height)));
}

Image render_overlay(std::span<const uint8_t> rgb, std::span<const float> score, int height,
                     int width, const HeatScale& scale) {
  const size_t pixels = static_cast<size_t>(height) * static_cast<size_t>(width);
  check(rgb.size() == 3 * pixels && score.size() == pixels, "render_overlay: sizes");
  check(scale.bound_u > 0, "render_overlay: positive bound");
  const float bound = static_cast<float>(scale.bound_u);
  Image out = beside_photo(rgb, height, width, [&](size_t i, float luma, uint8_t* target) {
    if (std::isnan(score[i])) {
      std::fill_n(target, 3, static_cast<uint8_t>(0.45f * luma));
    } else {
      blend(heat_color(score[i] / bound), 0.25f, luma, target);
    }
  });
  cv::Mat canvas(out.height, out.width, CV_8UC3, out.rgb.data());
  const int zoom = overlay_zoom(width, height), panel_width = zoom * width, top = zoom * height;
  draw_text(canvas, "grey: no evidence", panel_width / 2, top + 20);
  draw_legend(canvas, panel_width + kGap, top, panel_width, scale);
  return out;
}

std::array<uint8_t, 3> label_color(ChangeLabel label) {
  switch (label) {
    case ChangeLabel::kUnchanged:
      return {164, 173, 186};
    case ChangeLabel::kRemoved:
      return {213, 94, 0};
    case ChangeLabel::kAdded:
      return {0, 158, 115};
    case ChangeLabel::kUnobserved:
      return {92, 97, 106};
    case ChangeLabel::kNoEvidence:
      break;
  }
  check(false, "label_color: no evidence has no colour");
  return {};
}

Image render_label_overlay(std::span<const uint8_t> rgb, std::span<const ChangeLabel> label,
                           int height, int width) {
  const size_t pixels = static_cast<size_t>(height) * static_cast<size_t>(width);
  check(rgb.size() == 3 * pixels && label.size() == pixels, "render_label_overlay: sizes");
  // Shares of the light that keep the greys apart: no evidence ends at 63, unobserved runs from 69
  // to 120 (red), unchanged starts at 123.
  constexpr float kUnderColor = 0.2f, kAlone = 0.25f;
  Image out = beside_photo(rgb, height, width, [&](size_t i, float luma, uint8_t* target) {
    if (label[i] == ChangeLabel::kNoEvidence) {
      std::fill_n(target, 3, static_cast<uint8_t>(kAlone * luma));
    } else {
      blend(label_color(label[i]), kUnderColor, luma, target);
    }
  });
  cv::Mat canvas(out.height, out.width, CV_8UC3, out.rgb.data());
  const int zoom = overlay_zoom(width, height), panel_width = zoom * width, top = zoom * height;
  draw_text(canvas, "dim photo: no evidence", panel_width / 2, top + 20);
  draw_label_legend(canvas, panel_width + kGap, top);
  return out;
}

}  // namespace vggtcd
