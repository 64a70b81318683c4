// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/registration/small_similarity.h"

#include <gtest/gtest.h>

namespace vggtcd {
namespace {

TEST(SmallSimilarity, ParametersSurviveTheRoundTrip) {
  const Vector7 parameters = (Vector7() << 0.3, -0.2, 1.1, 4, -5, 6, -0.4).finished();
  const Eigen::Vector3d pivot(1, -2, 3);
  EXPECT_LT((similarity_parameters(small_similarity(parameters, pivot), pivot) - parameters).norm(),
            1e-12);
  EXPECT_LT((similarity_parameters(Sim3{}, pivot)).norm(), 1e-15);
}

TEST(PivotChange, DescribesTheSameMotionAboutAnotherPoint) {
  const Vector7 parameters = 1e-5 * (Vector7() << 0.3, -0.2, 1.1, 4, -5, 6, -0.4).finished();
  const Eigen::Vector3d from(1, -2, 3), to(-4, 5, 0.5);
  const Vector7 expected = similarity_parameters(small_similarity(parameters, from), to);
  const Vector7 actual = pivot_change(to - from) * parameters;
  // First order: what is left is quadratic in the motion, 1e-10 times the distance of the pivots.
  EXPECT_LT((actual - expected).norm(), 1e-8);
  EXPECT_GT((parameters - expected).norm(), 1e-5);
}

TEST(PointJacobian, IsTheDerivativeOfTheSimilarity) {
  const Eigen::Vector3d pivot(1, -2, 3), point(-4, 5, 0.5), normal(0.6, 0, -0.8);
  const Matrix3x7 jacobian = point_jacobian(point - pivot);
  const Vector7 along_normal = plane_jacobian(point - pivot, normal);
  constexpr double kStep = 1e-5;
  for (int k = 0; k < 7; ++k) {
    const Vector7 step = kStep * Vector7::Unit(k);
    const Eigen::Vector3d derivative =
        (small_similarity(step, pivot) * point - small_similarity(-step, pivot) * point) /
        (2 * kStep);
    // A central difference errs by the step squared, 1e-10, and rounding over the step, 1e-10.
    EXPECT_LT((jacobian.col(k) - derivative).norm(), 1e-8) << kDegreesOfFreedom[size_t(k)];
    EXPECT_NEAR(along_normal[k], normal.dot(derivative), 1e-8) << kDegreesOfFreedom[size_t(k)];
  }
}

TEST(SimilarityCovariance, GrowsWithTheLeverArm) {
  SimilarityCovariance about_origin;
  about_origin.covariance.diagonal() << 0.01, 0.01, 0.01, 1e-6, 1e-6, 1e-6, 0.04;
  const Matrix7 far = about_origin.about({10, 0, 0});
  EXPECT_NEAR(far(3, 3), 0.04 * 100, 1e-3);  // along the arm: scale
  EXPECT_NEAR(far(4, 4), 0.01 * 100, 1e-3);  // across: rotation
  EXPECT_NEAR(far(0, 0), 0.01, 1e-12);
}

}  // namespace
}  // namespace vggtcd
