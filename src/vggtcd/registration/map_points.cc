// SPDX-License-Identifier: Apache-2.0
// Points of one frame in another.
#include "vggtcd/registration/map_points.h"

namespace vggtcd {

std::vector<Eigen::Vector3f> map_points(const Sim3& b_from_a,
                                        const std::vector<Eigen::Vector3f>& points_in_a) {
  std::vector<Eigen::Vector3f> points_in_b;
  points_in_b.reserve(points_in_a.size());
  for (const Eigen::Vector3f& x : points_in_a) {
    points_in_b.push_back((b_from_a * x.cast<double>()).cast<float>());
  }
  return points_in_b;
}

}  // namespace vggtcd
