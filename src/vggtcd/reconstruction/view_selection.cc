// SPDX-License-Identifier: Apache-2.0
// Which photos to compare a photo with: shared points weighted by the angle between their rays.
#include "vggtcd/reconstruction/view_selection.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "vggtcd/geometry/order_statistics.h"

namespace vggtcd {
namespace {

double angle_deg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180.0 / std::numbers::pi;
}

struct Candidate {
  int view = 0;
  double score = 0;
  double angle_deg = 0;
};

void set_range(const SfmView& view, const std::vector<const SfmPoint*>& points, DepthTask& task) {
  std::vector<double> depths;
  for (const SfmPoint* point : points) {
    const double z = (view.camera_from_world * point->x_in_world).z();
    if (z > 0) depths.push_back(z);
  }
  if (depths.empty()) return;
  std::sort(depths.begin(), depths.end());
  const size_t strays = depths.size() / 50;
  constexpr double kNearer = 0.6, kFarther = 2.0;
  task.range.nearest_inverse = 1.0 / (kNearer * depths[strays]);
  task.range.farthest_inverse = 1.0 / (kFarther * depths[depths.size() - 1 - strays]);
}

}  // namespace

std::vector<DepthTask> plan_depth(const SfmModel& model, const std::vector<int>& group_of_view,
                                  const ViewSelectionOptions& options) {
  const size_t count = model.views.size();
  std::vector<std::vector<const SfmPoint*>> seen(count);
  std::vector<std::vector<double>> angles(count * count);
  std::vector<Eigen::Vector3d> centers;
  for (const SfmView& view : model.views) centers.push_back(camera_center(view.camera_from_world));
  for (const SfmPoint& point : model.points) {
    for (const int i : point.views) {
      seen[static_cast<size_t>(i)].push_back(&point);
      for (const int j : point.views) {
        if (i == j) continue;
        const auto a = static_cast<size_t>(i), b = static_cast<size_t>(j);
        angles[a * count + b].push_back(
            angle_deg(centers[a] - point.x_in_world, centers[b] - point.x_in_world));
      }
    }
  }
  std::vector<DepthTask> tasks(count);
  for (size_t i = 0; i < count; ++i) {
    std::vector<Candidate> candidates;
    for (size_t j = 0; j < count; ++j) {
      const auto& shared = angles[i * count + j];
      if (group_of_view[i] != group_of_view[j]) continue;
      if (static_cast<int>(shared.size()) < options.min_shared_points) continue;
      const double angle = middle_of(shared);
      if (angle < options.min_angle_deg || angle > options.max_angle_deg) continue;
      // A bell over the ratio to the best angle, so that half and double are as good.
      const double ratio = std::log(angle / options.best_angle_deg);
      const double score = static_cast<double>(shared.size()) * std::exp(-ratio * ratio);
      candidates.push_back({static_cast<int>(j), score, angle});
    }
    std::stable_sort(candidates.begin(), candidates.end(),
                     [](const Candidate& a, const Candidate& b) { return a.score > b.score; });
    if (candidates.size() > static_cast<size_t>(options.max_sources)) {
      candidates.resize(static_cast<size_t>(options.max_sources));
    }
    set_range(model.views[i], seen[i], tasks[i]);
    std::vector<double> chosen_angles;
    for (const Candidate& candidate : candidates) {
      tasks[i].sources.push_back(candidate.view);
      chosen_angles.push_back(candidate.angle_deg);
    }
    if (!chosen_angles.empty()) tasks[i].median_angle_deg = middle_of(chosen_angles);
  }
  return tasks;
}

}  // namespace vggtcd
