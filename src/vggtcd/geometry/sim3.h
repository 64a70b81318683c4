// SPDX-License-Identifier: Apache-2.0
// Sim3: a similarity, b_from_a: x_in_b = scale * rotation * x_in_a + translation.
#pragma once

#include <Eigen/Core>

#include "vggtcd/geometry/rigid3.h"

namespace vggtcd {

struct Sim3 {
  double scale = 1.0;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& x_in_a) const {
    return scale * (rotation * x_in_a) + translation;
  }
  // c_from_a = c_from_b * b_from_a.
  Sim3 operator*(const Sim3& b_from_a) const {
    return {scale * b_from_a.scale, rotation * b_from_a.rotation,
            scale * (rotation * b_from_a.translation) + translation};
  }
  // a_from_b.
  Sim3 inverse() const {
    const Eigen::Matrix3d inverse_rotation = rotation.transpose();
    return {1.0 / scale, inverse_rotation, -(inverse_rotation * translation) / scale};
  }
};

// The pose of the same camera after its world moved by new_from_old: for x_new = new_from_old *
// x_old, camera_from_new maps x_new to the camera's own axes in units of the new world (depths grow
// by new_from_old.scale).
Rigid3 camera_from_new_world(const Rigid3& camera_from_old, const Sim3& new_from_old);

}  // namespace vggtcd
