// SPDX-License-Identifier: Apache-2.0
// Points with surface normals, thinned to one per voxel: what surface registration works on.
#include "vggtcd/scene/oriented_points.h"

#include <Eigen/Geometry>
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

std::optional<Eigen::Vector3f> normal_at(const Reconstruction& r, uint32_t pixel, int radius_px) {
  const size_t in_frame = pixel % r.pixels_per_frame();
  const int u = static_cast<int>(in_frame % static_cast<size_t>(r.width));
  const int v = static_cast<int>(in_frame / static_cast<size_t>(r.width));
  if (u < radius_px || v < radius_px || u + radius_px >= r.width || v + radius_px >= r.height)
    return {};
  const View& view = r.views[pixel / r.pixels_per_frame()];
  const auto depth_at = [&](int du, int dv) {
    return static_cast<double>(
        r.depth[static_cast<size_t>(static_cast<int64_t>(pixel) + du + int64_t{dv} * r.width)]);
  };
  const double depth = depth_at(0, 0);
  const auto point_at = [&](int du, int dv) {
    return view.pinhole.unproject(u + du, v + dv, depth_at(du, dv));
  };
  for (const auto& [du, dv] :
       {std::pair{radius_px, 0}, {-radius_px, 0}, {0, radius_px}, {0, -radius_px}}) {
    if (std::abs(depth_at(du, dv) - depth) > kMaxDepthStep * depth)
      return {};  // also where depth is 0
  }
  // u to the right, v down: their cross product points away from the camera.
  const Eigen::Vector3d step_u = point_at(radius_px, 0) - point_at(-radius_px, 0);
  const Eigen::Vector3d step_v = point_at(0, radius_px) - point_at(0, -radius_px);
  const Eigen::Vector3d cross = step_v.cross(step_u);
  const double length = cross.norm();
  const Eigen::Vector3d ray = point_at(0, 0);
  if (!(length > 0) || std::abs(cross.dot(ray)) < kMinCosine * length * ray.norm()) return {};
  return (view.camera_from_world.rotation.transpose() * (cross / length)).cast<float>();
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
