// SPDX-License-Identifier: Apache-2.0
// Svg: the few shapes that the benchmark's plots are made of.
#pragma once

#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

namespace vggtcd {

class Svg {
 public:
  Svg(double width_px, double height_px);
  void polyline(const std::vector<Eigen::Vector2d>& points_px, std::string_view color,
                double width_px = 1.5, std::string_view dash = "");
  void circle(const Eigen::Vector2d& center_px, double radius_px, std::string_view color);
  void rectangle(const Eigen::Vector2d& corner_px, const Eigen::Vector2d& size_px,
                 std::string_view stroke);
  // anchor: start, middle or end.
  void text(const Eigen::Vector2d& at_px, std::string_view text, double size_px = 11,
            std::string_view anchor = "start");
  std::string finish() const;

 private:
  double width_px_, height_px_;
  std::string body_;
};

}  // namespace vggtcd
