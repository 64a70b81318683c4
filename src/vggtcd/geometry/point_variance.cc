// SPDX-License-Identifier: Apache-2.0
// PointVariance: how far an uncertain similarity may misplace a point.
#include "vggtcd/geometry/point_variance.h"

namespace vggtcd {

PointVariance::PointVariance(const Eigen::Matrix<double, 7, 7>& covariance,
                             const Eigen::Vector3d& pivot)
    : pivot_(pivot) {
  const Eigen::Matrix3d w = covariance.block<3, 3>(0, 0);
  const Eigen::Matrix3d t_and_w = covariance.block<3, 3>(3, 0);
  // |t|^2 + |w x a|^2 + |s a|^2, then 2 t . (w x a) = 2 a . (t x w) and 2 t . s a; w x a is
  // orthogonal to a.
  constant_ = covariance.block<3, 3>(3, 3).trace() / 3;
  quadratic_ = ((w.trace() + covariance(6, 6)) * Eigen::Matrix3d::Identity() - w) / 3;
  const Eigen::Vector3d t_cross_w(t_and_w(1, 2) - t_and_w(2, 1), t_and_w(2, 0) - t_and_w(0, 2),
                                  t_and_w(0, 1) - t_and_w(1, 0));
  linear_ = (t_cross_w + covariance.block<3, 1>(3, 6)) * (2.0 / 3);
}

}  // namespace vggtcd
