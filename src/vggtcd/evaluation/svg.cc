// SPDX-License-Identifier: Apache-2.0
// SVG text.
#include "vggtcd/evaluation/svg.h"

#include <fmt/format.h>

namespace vggtcd {

Svg::Svg(double width_px, double height_px) : width_px_(width_px), height_px_(height_px) {}

void Svg::polyline(const std::vector<Eigen::Vector2d>& points_px, std::string_view color,
                   double width_px, std::string_view dash) {
  body_ += "<polyline fill=\"none\" points=\"";
  for (const Eigen::Vector2d& p : points_px) body_ += fmt::format("{:.1f},{:.1f} ", p.x(), p.y());
  body_ += fmt::format("\" stroke=\"{}\" stroke-width=\"{}\"", color, width_px);
  if (!dash.empty()) body_ += fmt::format(" stroke-dasharray=\"{}\"", dash);
  body_ += "/>\n";
}

void Svg::circle(const Eigen::Vector2d& center_px, double radius_px, std::string_view color) {
  body_ += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\" fill=\"{}\"/>\n",
                       center_px.x(), center_px.y(), radius_px, color);
}

void Svg::rectangle(const Eigen::Vector2d& corner_px, const Eigen::Vector2d& size_px,
                    std::string_view stroke) {
  body_ += fmt::format(
      "<rect x=\"{:.1f}\" y=\"{:.1f}\" width=\"{:.1f}\" height=\"{:.1f}\" fill=\"none\" "
      "stroke=\"{}\"/>\n",
      corner_px.x(), corner_px.y(), size_px.x(), size_px.y(), stroke);
}

void Svg::text(const Eigen::Vector2d& at_px, std::string_view text, double size_px,
               std::string_view anchor) {
  std::string escaped;
  for (const char c : text) {
    if (c == '<')
      escaped += "&lt;";
    else if (c == '&')
      escaped += "&amp;";
    else
      escaped += c;
  }
  body_ +=
      fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" font-size=\"{}\" text-anchor=\"{}\">{}</text>\n",
                  at_px.x(), at_px.y(), size_px, anchor, escaped);
}

std::string Svg::finish() const {
  return fmt::format(
             "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" "
             "viewBox=\"0 0 {0} {1}\" font-family=\"sans-serif\" fill=\"#222\">\n"
             "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n",
             width_px_, height_px_) +
         body_ + "</svg>\n";
}

}  // namespace vggtcd
