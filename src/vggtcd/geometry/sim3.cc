// SPDX-License-Identifier: Apache-2.0
// Sim3: how a camera pose follows a similarity of its world.
#include "vggtcd/geometry/sim3.h"

namespace vggtcd {

Rigid3 camera_from_new_world(const Rigid3& camera_from_old, const Sim3& new_from_old) {
  // s * (R_c x_old + t_c) with x_old = R^T (x_new - t) / s.
  const Eigen::Matrix3d rotation = camera_from_old.rotation * new_from_old.rotation.transpose();
  return {rotation,
          new_from_old.scale * camera_from_old.translation - rotation * new_from_old.translation};
}

}  // namespace vggtcd
