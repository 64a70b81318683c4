// SPDX-License-Identifier: Apache-2.0
// Rigid3: a rotation and a translation, b_from_a: x_in_b = rotation * x_in_a + translation.
#pragma once

#include <Eigen/Core>

namespace vggtcd {

struct Rigid3 {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  Eigen::Vector3d operator*(const Eigen::Vector3d& x_in_a) const {
    return rotation * x_in_a + translation;
  }
  // c_from_a = c_from_b * b_from_a.
  Rigid3 operator*(const Rigid3& b_from_a) const {
    return {rotation * b_from_a.rotation, rotation * b_from_a.translation + translation};
  }
  // a_from_b.
  Rigid3 inverse() const { return {rotation.transpose(), -(rotation.transpose() * translation)}; }
};

// The camera centre in world coordinates: -R^T t of camera_from_world.
inline Eigen::Vector3d camera_center(const Rigid3& camera_from_world) {
  return -(camera_from_world.rotation.transpose() * camera_from_world.translation);
}

// Angle of a rotation in radians, in [0, pi], accurate near 0 and near pi.
double rotation_angle_rad(const Eigen::Matrix3d& rotation);

}  // namespace vggtcd
