// SPDX-License-Identifier: Apache-2.0
// Points of one frame in another.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "vggtcd/geometry/sim3.h"

namespace vggtcd {

// b_from_a applied to every stride-th point, in double, rounded once.
std::vector<Eigen::Vector3f> map_points(const Sim3& b_from_a,
                                        const std::vector<Eigen::Vector3f>& points_in_a,
                                        int stride = 1);

}  // namespace vggtcd
