// SPDX-License-Identifier: Apache-2.0
// ATE, RTE and RRE: laws, and a case computed by hand.
#include "vggtcd/evaluation/trajectory_metrics.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "vggtcd/core/error.h"
#include "vggtcd/evaluation/synthetic/random.h"

namespace vggtcd {
namespace {

using Eigen::Vector3d;

Rigid3 camera(const Vector3d& center, const Eigen::Matrix3d& camera_from_world_rotation) {
  return {camera_from_world_rotation, -(camera_from_world_rotation * center)};
}

BitemporalTrajectory random_truth(uint64_t seed) {
  Random random(seed);
  BitemporalTrajectory truth;
  for (int k = 0; k < 13; ++k) {
    const Vector3d center{random.normal(), random.normal(), random.normal()};
    const Vector3d axis{random.normal(), random.normal(), random.normal()};
    const Rigid3 pose = camera(
        center, Eigen::AngleAxisd(random.uniform(0, 3), axis.normalized()).toRotationMatrix());
    (k < 6 ? truth.t1 : truth.t2).push_back(pose);
  }
  return truth;
}

TEST(EvaluateTrajectory, IsZeroForTheTruthInAnyFrameAndScale) {
  const BitemporalTrajectory truth = random_truth(1);
  const Sim3 other_from_world{
      0.3, Eigen::AngleAxisd(2, Vector3d(1, 2, 3).normalized()).toRotationMatrix(), {4, 5, 6}};
  const Sim3 t1_from_world{
      1.7, Eigen::AngleAxisd(1, Vector3d(0, 1, 3).normalized()).toRotationMatrix(), {-1, 0, 2}};
  // Each epoch in a frame of its own, registered by the true Sim(3) between them.
  std::vector<Rigid3> t1, t2;
  for (const Rigid3& pose : truth.t1) t1.push_back(camera_from_new_world(pose, t1_from_world));
  for (const Rigid3& pose : truth.t2) t2.push_back(camera_from_new_world(pose, other_from_world));
  const Sim3 t2_from_t1 = other_from_world * t1_from_world.inverse();
  const TrajectoryErrors e = evaluate_trajectory(register_trajectory(t1, t2, t2_from_t1), truth);
  // Umeyama adds 1e-12 to the variance it divides by.
  EXPECT_LT(e.ate_mean, 1e-10);
  EXPECT_LT(e.rte_mean, 1e-10);
  EXPECT_LT(e.rre_mean_deg, 1e-5);
  EXPECT_NEAR(e.truth_from_predicted.scale, 1 / 0.3, 1e-10);
  EXPECT_EQ(e.frames, 13);
  // Without the registration the epochs do not fit together.
  EXPECT_GT(evaluate_trajectory(register_trajectory(t1, t2, {}), truth).ate_mean, 0.1);
}

TEST(EvaluateTrajectory, MeasuresAKnownDisplacement) {
  // Twelve camera centres on the axes at +-1 and +-2, T1 the first six. Each centre is pushed
  // outwards or inwards by 10 % alternately in a way that keeps scale, rotation and centroid of the
  // best fit: at (+-1) * 1.2 and (+-2) * (1 - 0.1): sum of |x||y| is what Umeyama's scale sees:
  // sum x y / sum x^2 with x predicted, y true.
  BitemporalTrajectory truth, predicted;
  const double grow[] = {1.2, 0.9};
  double xy = 0, xx = 0, expected_mean = 0, expected_square = 0;
  std::vector<Vector3d> centers;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      for (int ring = 0; ring < 2; ++ring)
        centers.push_back(sign * (ring + 1) * Vector3d::Unit(axis));
    }
  }
  for (const Vector3d& c : centers) {
    const double factor = grow[c.norm() > 1.5 ? 1 : 0];
    xy += factor * c.squaredNorm();
    xx += factor * factor * c.squaredNorm();
  }
  const double scale = xy / xx;
  for (size_t k = 0; k < centers.size(); ++k) {
    const double factor = grow[centers[k].norm() > 1.5 ? 1 : 0];
    const double error = std::abs(scale * factor - 1) * centers[k].norm();
    expected_mean += error / 12;
    expected_square += error * error / 12;
    (k < 6 ? truth.t1 : truth.t2).push_back(camera(centers[k], Eigen::Matrix3d::Identity()));
    (k < 6 ? predicted.t1 : predicted.t2)
        .push_back(camera(factor * centers[k], Eigen::Matrix3d::Identity()));
  }
  const TrajectoryErrors e = evaluate_trajectory(predicted, truth);
  EXPECT_NEAR(e.truth_from_predicted.scale, scale, 1e-9);
  EXPECT_NEAR(e.ate_mean, expected_mean, 1e-9);
  EXPECT_NEAR(e.ate_rmse, std::sqrt(expected_square), 1e-9);
  // Half of the errors are those of the inner ring, half of the outer: the median is between them.
  const double inner = std::abs(scale * 1.2 - 1), outer = 2 * std::abs(scale * 0.9 - 1);
  EXPECT_NEAR(e.ate_median, 0.5 * (inner + outer), 1e-9);
  EXPECT_NEAR(e.ate_relative * e.trajectory_length, e.ate_mean, 1e-12);
}

TEST(EvaluateTrajectory, RelativeErrorsLookAtNeighboursWithinAnEpochOnly) {
  BitemporalTrajectory truth = random_truth(2);
  BitemporalTrajectory predicted = truth;
  // The last camera of T2 turns by 6 degrees about its own centre: one of 5 + 6 pairs is off.
  const double angle = 6 * std::numbers::pi / 180;
  Rigid3& last = predicted.t2.back();
  const Vector3d center = camera_center(last);
  last = camera(center,
                Eigen::AngleAxisd(angle, Vector3d::UnitY()).toRotationMatrix() * last.rotation);
  const TrajectoryErrors e = evaluate_trajectory(predicted, truth);
  EXPECT_LT(e.ate_mean, 1e-9);
  EXPECT_NEAR(e.rre_mean_deg, 6.0 / 11, 1e-5);
  // The step is measured in the axes of the earlier camera: turning the later one changes nothing.
  EXPECT_LT(e.rte_mean, 1e-9);
  double length = 0;
  for (const auto* epoch : {&truth.t1, &truth.t2}) {
    for (size_t k = 0; k + 1 < epoch->size(); ++k) {
      length += (camera_center((*epoch)[k]) - camera_center((*epoch)[k + 1])).norm();
    }
  }
  EXPECT_NEAR(e.trajectory_length, length, 1e-9);
}

TEST(EvaluateTrajectory, RefusesOtherNumbersOfFramesAndLines) {
  const BitemporalTrajectory truth = random_truth(3);
  BitemporalTrajectory fewer = truth;
  fewer.t1.pop_back();
  EXPECT_THROW(evaluate_trajectory(fewer, truth), Error);
  BitemporalTrajectory line;
  for (int k = 0; k < 4; ++k) {
    line.t1.push_back(camera(Vector3d(k, 0, 0), Eigen::Matrix3d::Identity()));
    line.t2.push_back(camera(Vector3d(k, 0, 0), Eigen::Matrix3d::Identity()));
  }
  try {
    evaluate_trajectory(line, line);
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kDegenerate);
  }
}

}  // namespace
}  // namespace vggtcd
