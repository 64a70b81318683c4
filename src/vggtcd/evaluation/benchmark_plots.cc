// SPDX-License-Identifier: Apache-2.0
// Plots in the manner of the paper's figures: trajectories from above, ATE over keyframes.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "vggtcd/evaluation/benchmark_report.h"
#include "vggtcd/evaluation/change_tables.h"
#include "vggtcd/evaluation/registration_methods.h"
#include "vggtcd/evaluation/svg.h"

namespace vggtcd {
namespace {

using Eigen::Vector2d;
using Points = std::vector<Eigen::Vector3d>;

// The two directions in which the true cameras spread most: "from above" whatever the frame.
struct View2d {
  Eigen::Matrix<double, 2, 3> axes = Eigen::Matrix<double, 2, 3>::Zero();
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double radius = 1;

  View2d(const Points& t1, const Points& t2) {
    Points all = t1;
    all.insert(all.end(), t2.begin(), t2.end());
    if (all.empty()) return;
    for (const auto& p : all) center += p / static_cast<double>(all.size());
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    for (const auto& p : all) covariance += (p - center) * (p - center).transpose();
    // Power iteration, twice; enough for a picture.
    for (int row = 0; row < 2; ++row) {
      Eigen::Vector3d v(1, 0.7, 0.4);
      for (int k = 0; k < 100; ++k) {
        v = covariance * v;
        if (row == 1) v -= axes.row(0).dot(v) * axes.row(0).transpose();
        if (v.norm() > 0) v.normalize();
      }
      axes.row(row) = v.transpose();
    }
    for (const auto& p : all)
      radius = std::max(1e-9, std::max(radius == 1 ? 0 : radius, (p - center).norm()));
  }
  Vector2d pixel(const Eigen::Vector3d& p, const Vector2d& middle_px, double half_px) const {
    const Vector2d flat = axes * (p - center) * (0.8 * half_px / radius);
    // What flies out of the panel is held at its rim.
    return middle_px + Vector2d(std::clamp(flat.x(), -half_px, half_px),
                                std::clamp(-flat.y(), -half_px, half_px));
  }
};

std::vector<Vector2d> project(const View2d& view, const Points& points, const Vector2d& middle,
                              double half) {
  std::vector<Vector2d> result;
  for (const auto& p : points) result.push_back(view.pixel(p, middle, half));
  return result;
}

}  // namespace

std::string trajectories_svg(const SuiteReport& report) {
  std::vector<RegistrationMethod> methods;
  for (RegistrationMethod& method : registration_methods()) {
    const bool any =
        std::any_of(report.scenes.begin(), report.scenes.end(), [&](const auto& scene) {
          return std::any_of(scene.methods.begin(), scene.methods.end(), [&](const auto& outcome) {
            return outcome.method == method.name && outcome.failure.empty();
          });
        });
    if (any) methods.push_back(std::move(method));
  }
  constexpr double kPanel = 130, kLeft = 130, kTop = 40;
  constexpr double kTitleWidth = 600;
  Svg svg(std::max(kTitleWidth, kLeft + kPanel * static_cast<double>(report.scenes.size()) + 10),
          kTop + kPanel * static_cast<double>(methods.size()) + 10);
  svg.text({10, 18}, "Cameras from above: true (green), predicted (red); T1 solid, T2 dashed", 13);
  for (size_t column = 0; column < report.scenes.size(); ++column) {
    const SceneOutcome& scene = report.scenes[column];
    const View2d view(scene.true_centers_t1, scene.true_centers_t2);
    const double x = kLeft + kPanel * (static_cast<double>(column) + 0.5);
    svg.text({x, kTop - 6}, scene_title(scene), 11, "middle");
    for (size_t row = 0; row < methods.size(); ++row) {
      const Vector2d middle(x, kTop + kPanel * (static_cast<double>(row) + 0.5));
      const double half = 0.5 * kPanel - 5;
      if (column == 0) svg.text({10, middle.y()}, methods[row].title, 11);
      svg.rectangle(middle - Vector2d(half, half), {2 * half, 2 * half}, "#ddd");
      for (const MethodOutcome& outcome : scene.methods) {
        if (outcome.method != methods[row].name || !outcome.failure.empty()) continue;
        svg.polyline(project(view, outcome.centers_t1, middle, half), "#d33");
        svg.polyline(project(view, outcome.centers_t2, middle, half), "#d33", 1.5, "4 2");
        svg.text(middle + Vector2d(-half + 3, half - 4),
                 fmt::format("ATE {:.3f}", outcome.errors.ate_mean), 9);
      }
      svg.polyline(project(view, scene.true_centers_t1, middle, half), "#2a2", 1.2);
      svg.polyline(project(view, scene.true_centers_t2, middle, half), "#2a2", 1.2, "4 2");
    }
  }
  return svg.finish();
}

std::string ablation_svg(const SuiteReport& report) {
  // Means over the scenes that have most budgets (frames enough for them), so that the points
  // compare.
  size_t budgets = 0;
  for (const SceneOutcome& scene : report.scenes)
    budgets = std::max(budgets, scene.ablation.size());
  std::map<int, std::pair<double, double>> sums;
  std::map<int, int> counts;
  for (const SceneOutcome& scene : report.scenes) {
    if (scene.ablation.size() < budgets) continue;
    for (const AblationOutcome& a : scene.ablation) {
      const int key = a.keyframes == 0 ? 1 << 20 : a.keyframes;
      sums[key].first += a.coarse_ate;
      sums[key].second += a.full_ate;
      ++counts[key];
    }
  }
  constexpr double kWidth = 480, kHeight = 300, kLeft = 60, kBottom = 250, kTopY = 40;
  Svg svg(kWidth, kHeight);
  svg.text({kLeft, 20}, "Mean ATE: coarse (dashed) and with the fine stage", 12);
  double highest = 1e-12;
  for (const auto& [key, sum] : sums) {
    highest = std::max({highest, sum.first / counts[key], sum.second / counts[key]});
  }
  std::vector<Vector2d> coarse, full;
  std::vector<std::pair<Vector2d, const char*>> circles;
  double x = kLeft + 20;
  for (const auto& [key, sum] : sums) {
    const auto height = [&](double ate) {
      return kBottom - (kBottom - kTopY) * ate / (1.1 * highest);
    };
    coarse.emplace_back(x, height(sum.first / counts[key]));
    full.emplace_back(x, height(sum.second / counts[key]));
    svg.text({x, kBottom + 16}, key == 1 << 20 ? "all" : std::to_string(key), 10, "middle");
    circles.emplace_back(full.back(), key == 5 ? "#e80" : "#25c");
    x += 45;
  }
  for (int tick = 0; tick <= 4; ++tick) {
    const double ate = 1.1 * highest * tick / 4;
    const double y = kBottom - (kBottom - kTopY) * tick / 4;
    svg.polyline({{kLeft, y}, {kWidth - 10, y}}, "#eee", 1);
    svg.text({kLeft - 5, y + 4}, fmt::format("{:.3f}", ate), 10, "end");
  }
  svg.polyline(coarse, "#25c", 1.5, "5 3");
  svg.polyline(full, "#25c", 1.8);
  for (const auto& [center, color] : circles) svg.circle(center, 3, color);
  svg.text({kWidth / 2, kHeight - 12}, "keyframes K per epoch (orange: the paper's 5)", 10,
           "middle");
  return svg.finish();
}

}  // namespace vggtcd
