// SPDX-License-Identifier: Apache-2.0
// Numbers of any size in prediction files: one pixel far from all others, an origin far away.
#include <Eigen/LU>
#include <cmath>
#include <vector>

#include "vggtcd/core/error.h"
#include "vggtcd/io/prediction_layout.h"
#include "vggtcd/scene/local_frame.h"
#include "vggtcd/scene/stray_depths.h"

namespace vggtcd::internal {
namespace {

// Where the cameras are as the file has them: poses are made exact rotations on reading, and where
// the origin is far away that alone would move them.
std::vector<Eigen::Vector3d> centers_in_file(const NpzReader& npz, const PredictionLayout& layout,
                                             const Reconstruction& result) {
  const std::vector<double> poses = npz.read<double>(layout.poses);
  const size_t stride = poses.size() / static_cast<size_t>(layout.frames);
  std::vector<Eigen::Vector3d> centers;
  for (size_t frame = 0; frame < result.views.size(); ++frame) {
    const Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> pose(
        &poses[frame * stride]);
    const Eigen::Matrix3d axes = pose.leftCols<3>();
    centers.push_back(layout.world_from_camera ? Eigen::Vector3d(pose.col(3))
                                               : -(axes.inverse() * pose.col(3)));
  }
  return centers;
}

// The difference between a number and the next one of its size, for the type that it is stored in.
double resolution_of(const NpyHeader& header) {
  return std::ldexp(1.0, header.item_size >= 8 ? -52 : header.item_size >= 4 ? -23 : -10);
}

}  // namespace

void drop_strays(const std::string& name, Reconstruction& result, ProgressSink& progress) {
  const StrayDepths strays = drop_stray_depths(result);
  if (strays.count() == 0) return;
  progress.notice(fmt::format(
      "{}: {} of {} pixels are ignored: their depth is far from all others, {:.3g} to {:.3g}, and "
      "so no part of the scene: {} beyond, {} before",
      name, strays.count(), result.num_pixels(), strays.nearest, strays.farthest, strays.too_far,
      strays.too_near));
}

void move_near(const NpzReader& npz, const PredictionLayout& layout, Reconstruction& result,
               ProgressSink& progress) {
  const std::vector<Eigen::Vector3d> centers = centers_in_file(npz, layout, result);
  use_local_frame(result, centers);
  const double distance = result.origin_in_world.cwiseAbs().maxCoeff();
  const double step = distance * resolution_of(npz.header(layout.poses));
  constexpr double kFine = 1e-4;  // of the scene
  if (step <= kFine * scene_size(result, centers).size) return;
  progress.notice(fmt::format(
      "{}: {}: {}-bit numbers tell positions {:.3g} away from the origin apart by {:.2g} only; "
      "save poses as 64-bit numbers, or relative to a place nearby",
      npz.name(), layout.poses, 8 * npz.header(layout.poses).item_size, distance, step));
}

}  // namespace vggtcd::internal
