// SPDX-License-Identifier: Apache-2.0
// Points with surface normals, thinned to one per voxel: what surface registration works on.
#include "vggtcd/scene/oriented_points.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <optional>

#include "vggtcd/core/parallel.h"
#include "vggtcd/geometry/robust_extent.h"
#include "vggtcd/geometry/voxel_grid.h"
#include "vggtcd/scene/confidence.h"
#include "vggtcd/scene/point_cloud.h"

namespace vggtcd {
namespace {

constexpr double kMaxDepthStep = 0.05;  // of the depth itself: beyond it lies another surface
constexpr double kMinCosine = 0.1;      // to the viewing ray
constexpr double kMinSupport = 0.6;     // of the window's pixels that lie on the surface

// The inverse depth of a plane is linear in the pixel: n . x = d and x = z K^-1 (u, v, 1) give
// 1 / z = (n / d) . K^-1 (u, v, 1). The least-squares fit of that line over the window is a plane
// fit that one pixel's depth noise hardly moves.
std::optional<Eigen::Vector3f> normal_at(const Reconstruction& r, uint32_t pixel, int radius_px) {
  const size_t in_frame = pixel % r.pixels_per_frame();
  const int u = static_cast<int>(in_frame % static_cast<size_t>(r.width));
  const int v = static_cast<int>(in_frame / static_cast<size_t>(r.width));
  if (u < radius_px || v < radius_px || u + radius_px >= r.width || v + radius_px >= r.height) {
    return {};
  }
  const double depth = static_cast<double>(r.depth[pixel]);
  Eigen::Matrix3d normal_matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right_side = Eigen::Vector3d::Zero();
  int support = 0;
  for (int dv = -radius_px; dv <= radius_px; ++dv) {
    for (int du = -radius_px; du <= radius_px; ++du) {
      const float other = r.depth[static_cast<size_t>(int64_t{pixel} + du + int64_t{dv} * r.width)];
      if (std::abs(static_cast<double>(other) - depth) > kMaxDepthStep * depth)
        continue;  // also depth 0
      const Eigen::Vector3d row(du, dv, 1);
      normal_matrix += row * row.transpose();
      right_side += row / static_cast<double>(other);
      ++support;
    }
  }
  const int window = (2 * radius_px + 1) * (2 * radius_px + 1);
  if (support < kMinSupport * window) return {};
  const Eigen::Vector3d line = normal_matrix.ldlt().solve(right_side);  // about this pixel
  const View& view = r.views[pixel / r.pixels_per_frame()];
  const Pinhole& camera = view.pinhole;
  // Its value at the principal point is the third component of n / d.
  Eigen::Vector3d normal(line[0] * camera.fx, line[1] * camera.fy,
                         line[2] + line[0] * (camera.cx - u) + line[1] * (camera.cy - v));
  normal.normalize();
  const Eigen::Vector3d ray = camera.unproject(u, v, 1.0).normalized();
  const double cosine = normal.dot(ray);
  if (!(std::abs(cosine) >= kMinCosine)) return {};  // grazing, or not a number
  if (cosine > 0) normal = -normal;                  // towards the camera
  return (view.camera_from_world.rotation.transpose() * normal).cast<float>();
}

}  // namespace

OrientedPoints oriented_points(const Reconstruction& reconstruction, int grid_resolution,
                               int radius_px) {
  PointCloud cloud = unproject(reconstruction, confidence_threshold(reconstruction));
  OrientedPoints result;
  result.voxel_size_u = robust_extent(cloud.positions) / grid_resolution;

  // A pixel without a normal must not win a voxel: its rank drops below all others.
  constexpr int64_t kGrain = 1 << 16;
  parallel_for(static_cast<int64_t>(cloud.size()), kGrain, [&](int64_t begin, int64_t end) {
    for (size_t i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
      if (!normal_at(reconstruction, cloud.pixels[i], radius_px)) {
        cloud.confidence[i] = -std::numeric_limits<float>::infinity();
      }
    }
  });
  for (const uint32_t i :
       voxel_downsample(cloud.positions, cloud.confidence, result.voxel_size_u)) {
    const auto normal = normal_at(reconstruction, cloud.pixels[i], radius_px);
    if (!normal) continue;
    result.positions.push_back(cloud.positions[i]);
    result.normals.push_back(*normal);
    result.frames.push_back(
        static_cast<int32_t>(cloud.pixels[i] / reconstruction.pixels_per_frame()));
  }
  return result;
}

}  // namespace vggtcd
