// SPDX-License-Identifier: Apache-2.0
// Local frames: where their origin lies, and what follows for poses and similarities.
#include "vggtcd/scene/local_frame.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <vector>

#include "vggtcd/core/error.h"
#include "vggtcd/geometry/order_statistics.h"

namespace vggtcd {
namespace {

// At this many sizes a float still tells 1 / 160 000 of the scene apart.
constexpr double kNear = 100;

double median_depth(const Reconstruction& r) {
  constexpr size_t kStride = 97;  // as many pixels as it takes
  std::vector<double> depths;
  for (size_t stride = kStride; depths.empty() && stride > 0; stride /= kStride) {
    for (size_t pixel = 0; pixel < r.num_pixels(); pixel += stride) {
      if (r.depth[pixel] > 0) depths.push_back(static_cast<double>(r.depth[pixel]));
    }
  }
  return depths.empty() ? 0 : middle_of(std::move(depths));
}

}  // namespace

Eigen::Vector3d local_origin(const Eigen::Vector3d& middle, double size) {
  check(size > 0, "local_origin: a scene with a size");
  if (!(middle.cwiseAbs().maxCoeff() > kNear * size)) return Eigen::Vector3d::Zero();
  const double step = std::ldexp(1.0, std::ilogb(size));
  return (middle / step).array().round() * step;
}

SceneSize scene_size(const Reconstruction& reconstruction,
                     std::span<const Eigen::Vector3d> camera_centers) {
  std::vector<Eigen::Vector3d> known;
  std::ranges::copy_if(camera_centers, std::back_inserter(known),
                       [](const Eigen::Vector3d& center) { return center.allFinite(); });
  SceneSize scene;
  scene.size = median_depth(reconstruction);
  if (known.empty()) return scene;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const Eigen::Vector3d& center : known) values.push_back(center[axis]);
    scene.middle[axis] = middle_of(std::move(values));
  }
  std::vector<double> distances;
  for (const Eigen::Vector3d& center : known) distances.push_back((center - scene.middle).norm());
  scene.size += middle_of(std::move(distances));
  return scene;
}

void use_local_frame(Reconstruction& reconstruction,
                     std::span<const Eigen::Vector3d> camera_centers) {
  check(camera_centers.size() == reconstruction.views.size(), "use_local_frame: a centre per view");
  const SceneSize scene = scene_size(reconstruction, camera_centers);
  const Eigen::Vector3d origin = local_origin(scene.middle, scene.size);
  if (origin.isZero(0)) return;
  reconstruction.origin_in_world = origin;
  for (size_t i = 0; i < camera_centers.size(); ++i) {
    if (!camera_centers[i].allFinite()) continue;
    Rigid3& pose = reconstruction.views[i].camera_from_world;
    pose.translation = -(pose.rotation * (camera_centers[i] - origin));
  }
}

Sim3 between_worlds(const Sim3& local_b_from_a, const Eigen::Vector3d& origin_a,
                    const Eigen::Vector3d& origin_b) {
  if (origin_a.isZero(0) && origin_b.isZero(0)) return local_b_from_a;
  Sim3 result = local_b_from_a;
  result.translation += origin_b - result.scale * (result.rotation * origin_a);
  return result;
}

Sim3 between_local_frames(const Sim3& world_b_from_a, const Eigen::Vector3d& origin_a,
                          const Eigen::Vector3d& origin_b) {
  return between_worlds(world_b_from_a, -origin_a, -origin_b);
}

}  // namespace vggtcd
