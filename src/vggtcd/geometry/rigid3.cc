// SPDX-License-Identifier: Apache-2.0
// Rigid3: the angle of a rotation.
#include "vggtcd/geometry/rigid3.h"

#include <cmath>

namespace vggtcd {

double rotation_angle_rad(const Eigen::Matrix3d& rotation) {
  // The skew part has length 2 sin, the trace is 1 + 2 cos: atan2 is accurate where acos is not.
  const Eigen::Vector3d skew(rotation(2, 1) - rotation(1, 2), rotation(0, 2) - rotation(2, 0),
                             rotation(1, 0) - rotation(0, 1));
  return std::atan2(skew.norm(), rotation.trace() - 1.0);
}

}  // namespace vggtcd
