// SPDX-License-Identifier: Apache-2.0
// Local frames: points are floats of seven digits, so a scene that lies far from its origin (UTM,
// ECEF) is computed about an origin nearby; where that is, is known in double.
#pragma once

#include <Eigen/Core>
#include <span>

#include "vggtcd/geometry/sim3.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

// The origin for a scene around `middle` that is about `size` large: zero as long as that is nearer
// than 100 sizes, else near the middle, in whole steps of a power of two of about the size, so that
// subtracting it is exact. Frames that are all right keep their bits.
Eigen::Vector3d local_origin(const Eigen::Vector3d& middle, double size);

// The size that a scene counts as for that: the median distance of the cameras from their middle
// (per axis the median) and the median depth. Centres that are not finite do not count.
struct SceneSize {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double size = 0;
};
SceneSize scene_size(const Reconstruction& reconstruction,
                     std::span<const Eigen::Vector3d> camera_centers);

// Moves the origin of the frame near the scene and says where it lies. `camera_centers` are those
// of the views in the file's world, as exact as the file has them.
void use_local_frame(Reconstruction& reconstruction,
                     std::span<const Eigen::Vector3d> camera_centers);

// One similarity between two epochs: of their worlds, from that of their local frames, and back.
// Where both origins are zero it stays as it is.
Sim3 between_worlds(const Sim3& local_b_from_a, const Eigen::Vector3d& origin_a,
                    const Eigen::Vector3d& origin_b);
Sim3 between_local_frames(const Sim3& world_b_from_a, const Eigen::Vector3d& origin_a,
                          const Eigen::Vector3d& origin_b);

// The pose of a camera in a world where the frame's origin lies there.
inline Rigid3 camera_from_world(const Rigid3& camera_from_local, const Eigen::Vector3d& origin) {
  if (origin.isZero(0)) return camera_from_local;
  return {camera_from_local.rotation,
          camera_from_local.translation - camera_from_local.rotation * origin};
}

}  // namespace vggtcd
