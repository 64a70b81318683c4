// SPDX-License-Identifier: Apache-2.0
// PointVariance: how far an uncertain similarity may misplace a point.
#pragma once

#include <Eigen/Core>

namespace vggtcd {

// The mean over the three axes of the variance of a point x under a small similarity about a pivot,
// x + w x a + t + s a with a = x - pivot: a quadratic form in a. Units are those of the frame.
class PointVariance {
 public:
  PointVariance() = default;  // certain: 0 everywhere
  // The covariance of w (rad), t, s, in this order.
  PointVariance(const Eigen::Matrix<double, 7, 7>& covariance, const Eigen::Vector3d& pivot);

  double operator()(const Eigen::Vector3d& x) const {
    const Eigen::Vector3d a = x - pivot_;
    return constant_ + linear_.dot(a) + a.dot(quadratic_ * a);
  }

 private:
  Eigen::Vector3d pivot_ = Eigen::Vector3d::Zero(), linear_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d quadratic_ = Eigen::Matrix3d::Zero();
  double constant_ = 0;
};

}  // namespace vggtcd
