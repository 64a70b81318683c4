// SPDX-License-Identifier: Apache-2.0
// Which photos of the other epoch look at what a photo shows.
#include "vggtcd/scene/view_overlap.h"

#include <algorithm>
#include <numeric>

#include "vggtcd/core/parallel.h"
#include "vggtcd/scene/point_cloud.h"

namespace vggtcd {
namespace {

constexpr int kSamplesAcross = 16;  // sample points along each side of a photo

std::vector<Eigen::Vector3d> sample_points(const Reconstruction& r, int frame,
                                           const Sim3& out_from_world) {
  const PixelRays rays(r.views[static_cast<size_t>(frame)], out_from_world);
  const auto depth = r.frame_depth(frame);
  std::vector<Eigen::Vector3d> points;
  for (int row = 0; row < kSamplesAcross; ++row) {
    for (int column = 0; column < kSamplesAcross; ++column) {
      const int u = (2 * column + 1) * r.width / (2 * kSamplesAcross);
      const int v = (2 * row + 1) * r.height / (2 * kSamplesAcross);
      const float d =
          depth[static_cast<size_t>(v) * static_cast<size_t>(r.width) + static_cast<size_t>(u)];
      if (d > 0) points.push_back(rays.point(u, v, d).cast<double>());
    }
  }
  return points;
}

double overlap(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& center,
               const View& other) {
  const Eigen::Vector3d other_center = camera_center(other.camera_from_world);
  double sum = 0;
  for (const Eigen::Vector3d& x : points) {
    const Eigen::Vector3d x_in_other = other.camera_from_world * x;
    if (x_in_other.z() <= 0) continue;
    const Eigen::Vector2d uv = other.pinhole.project(x_in_other);
    if (!other.pinhole.contains(uv.x(), uv.y())) continue;
    sum += std::max(0.0, (x - center).normalized().dot((x - other_center).normalized()));
  }
  return sum;
}

}  // namespace

std::vector<std::vector<int>> overlapping_views(const Reconstruction& from,
                                                const Reconstruction& to, const Sim3& to_from_from,
                                                int max_views) {
  std::vector<std::vector<int>> result(from.views.size());
  parallel_for(from.num_frames(), 1, [&](int64_t frame, int64_t) {
    const size_t index = static_cast<size_t>(frame);
    const auto points = sample_points(from, static_cast<int>(frame), to_from_from);
    const Eigen::Vector3d center =
        to_from_from * camera_center(from.views[index].camera_from_world);
    std::vector<double> scores;
    for (const View& view : to.views) scores.push_back(overlap(points, center, view));
    std::vector<int> order(to.views.size());
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
      return scores[static_cast<size_t>(a)] > scores[static_cast<size_t>(b)];
    });
    for (const int view : order) {
      if (static_cast<int>(result[index].size()) == max_views ||
          !(scores[static_cast<size_t>(view)] > 0))
        break;
      result[index].push_back(view);
    }
  });
  return result;
}

}  // namespace vggtcd
