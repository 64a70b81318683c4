// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/geometry/point_variance.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

namespace vggtcd {
namespace {

TEST(PointVariance, IsTheTraceOfThePropagatedCovariance) {
  Eigen::Matrix<double, 7, 7> root;
  for (int i = 0; i < 49; ++i) root(i / 7, i % 7) = std::sin(1.3 * i + 0.2) * (1 + i % 5);
  const Eigen::Matrix<double, 7, 7> covariance = root * root.transpose();
  const Eigen::Vector3d pivot(1, -2, 3);
  const PointVariance variance(covariance, pivot);
  for (const Eigen::Vector3d& x : {pivot, Eigen::Vector3d(4, 5, -6), Eigen::Vector3d(-0.1, 0, 9)}) {
    Eigen::Matrix<double, 3, 7> jacobian;  // column by column: what each parameter does to x
    for (int k = 0; k < 3; ++k) {
      jacobian.col(k) = Eigen::Vector3d::Unit(k).cross(x - pivot);
      jacobian.col(3 + k) = Eigen::Vector3d::Unit(k);
    }
    jacobian.col(6) = x - pivot;
    const double expected = (jacobian * covariance * jacobian.transpose()).trace() / 3;
    EXPECT_NEAR(variance(x), expected, 1e-12 * expected);
  }
}

TEST(PointVariance, WithoutUncertaintyIsZero) {
  EXPECT_EQ(PointVariance()(Eigen::Vector3d(1, 2, 3)), 0);
}

}  // namespace
}  // namespace vggtcd
