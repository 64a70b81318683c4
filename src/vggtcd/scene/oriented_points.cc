// SPDX-License-Identifier: Apache-2.0
// Points with surface normals, thinned to one per voxel: what surface registration works on.
#include "vggtcd/scene/oriented_points.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

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

// What the fit needs of a window: sums over its pixels that lie on the surface, (u, v) relative to
// the pixel in the middle. Those of whole numbers are exact.
struct WindowSums {
  int support = 0, u = 0, v = 0, uu = 0, uv = 0, vv = 0;
  Eigen::Vector3d right_side = Eigen::Vector3d::Zero();  // of (u, v, 1) / depth

  // `depths` points at the column of the middle.
  void add_row(const float* depths, int dv, int radius_px, double depth) {
    int row_support = 0, row_u = 0;
    double row_inverse = 0, row_u_inverse = 0;
    for (int du = -radius_px; du <= radius_px; ++du) {
      const double other = static_cast<double>(depths[du]);
      if (std::abs(other - depth) > kMaxDepthStep * depth) continue;  // also depth 0
      const double inverse = 1 / other;
      ++row_support;
      row_u += du;
      uu += du * du;
      row_inverse += inverse;
      row_u_inverse += du * inverse;
    }
    support += row_support;
    u += row_u;
    v += dv * row_support;
    uv += dv * row_u;
    vv += dv * dv * row_support;
    right_side += Eigen::Vector3d(row_u_inverse, dv * row_inverse, row_inverse);
  }
  Eigen::Matrix3d normal_matrix() const {
    Eigen::Matrix3d matrix;
    matrix << uu, uv, u, uv, vv, v, u, v, support;
    return matrix;
  }
};

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
  WindowSums sums;
  for (int dv = -radius_px; dv <= radius_px; ++dv) {
    sums.add_row(&r.depth[static_cast<size_t>(int64_t{pixel} + int64_t{dv} * r.width)], dv,
                 radius_px, depth);
  }
  const int window = (2 * radius_px + 1) * (2 * radius_px + 1);
  if (sums.support < kMinSupport * window) return {};
  const Eigen::Vector3d line = sums.normal_matrix().ldlt().solve(sums.right_side);
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

// A point of the cloud and the normal of its surface.
struct Surfel {
  uint32_t point;
  Eigen::Vector3f normal;
};

// Those of the points that have a normal, in the same order; the others are appended to `without`.
std::vector<Surfel> surfels_of(const Reconstruction& reconstruction, const PointCloud& cloud,
                               const std::vector<uint32_t>& points, int radius_px,
                               std::vector<uint32_t>& without) {
  std::vector<std::optional<Eigen::Vector3f>> normals(points.size());
  constexpr int64_t kGrain = 1 << 12;
  parallel_for(static_cast<int64_t>(points.size()), kGrain, [&](int64_t begin, int64_t end) {
    for (size_t i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
      normals[i] = normal_at(reconstruction, cloud.pixels[points[i]], radius_px);
    }
  });
  std::vector<Surfel> surfels;
  surfels.reserve(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    if (normals[i]) {
      surfels.push_back({points[i], *normals[i]});
    } else {
      without.push_back(points[i]);
    }
  }
  return surfels;
}

// The most confident of each voxel.
std::vector<Surfel> thinned(const std::vector<Surfel>& surfels, const PointCloud& cloud,
                            double voxel_size_u) {
  std::vector<Eigen::Vector3f> positions;
  std::vector<float> confidence;
  for (const Surfel& surfel : surfels) {
    positions.push_back(cloud.positions[surfel.point]);
    confidence.push_back(cloud.confidence[surfel.point]);
  }
  std::vector<Surfel> result;
  for (const uint32_t i : voxel_downsample(positions, confidence, voxel_size_u)) {
    result.push_back(surfels[i]);
  }
  return result;
}

}  // namespace

OrientedPoints oriented_points(const Reconstruction& reconstruction, int grid_resolution,
                               int radius_px) {
  const PointCloud cloud = unproject(reconstruction, confidence_threshold(reconstruction));
  OrientedPoints result;
  result.voxel_size_u = robust_extent(cloud.positions) / grid_resolution;

  // A plane fit costs far more than the grid. Nearly everywhere the most confident pixel of a voxel
  // has a normal, and the others need none; only in the remaining voxels all pixels are asked.
  std::vector<uint32_t> without, never;
  std::vector<Surfel> surfels = surfels_of(
      reconstruction, cloud,
      voxel_downsample(cloud.positions, cloud.confidence, result.voxel_size_u), radius_px, without);
  const std::vector<Surfel> others =
      thinned(surfels_of(reconstruction, cloud,
                         points_in_voxels_of(cloud.positions, without, result.voxel_size_u),
                         radius_px, never),
              cloud, result.voxel_size_u);
  surfels.insert(surfels.end(), others.begin(), others.end());
  std::ranges::sort(surfels, {}, &Surfel::point);

  result.origin_in_world = reconstruction.origin_in_world;
  for (const View& view : reconstruction.views) {
    result.cameras.push_back(camera_center(view.camera_from_world));
  }
  for (const Surfel& surfel : surfels) {
    result.positions.push_back(cloud.positions[surfel.point]);
    result.normals.push_back(surfel.normal);
    result.frames.push_back(
        static_cast<int32_t>(cloud.pixels[surfel.point] / reconstruction.pixels_per_frame()));
  }
  return result;
}

}  // namespace vggtcd
