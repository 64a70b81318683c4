// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/registration/initial_uncertainty.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>

#include "vggtcd/geometry/umeyama.h"

namespace vggtcd {
namespace {

using Points = std::vector<Eigen::Vector3d>;

std::vector<double> ones(const Points& points) { return std::vector<double>(points.size(), 1.0); }

class Draw {
 public:
  explicit Draw(uint32_t seed) : engine_(seed) {}
  double normal(double sigma) { return std::normal_distribution<double>(0, sigma)(engine_); }
  Eigen::Vector3d vector(double sigma) { return {normal(sigma), normal(sigma), normal(sigma)}; }
  Vector7 similarity(const FrameSpread& spread) {
    Vector7 p;
    p << vector(spread.rotation_rad), vector(spread.translation_u), normal(spread.log_scale);
    return p;
  }

 private:
  std::mt19937 engine_;
};

constexpr FrameSpread kSpread{0.02, 0.03, 0.015};

// An epoch whose keyframes lie in a ring; the joint pass has them with errors of their own.
std::vector<KeyframeWitness> witnesses_of_a_fit(Draw& draw, int keyframes, Sim3& fit) {
  std::vector<Points> in_epoch(static_cast<size_t>(keyframes)), in_joint = in_epoch;
  Points all_epoch, all_joint;
  for (size_t k = 0; k < in_epoch.size(); ++k) {
    const double angle = 2 * 3.14159265 * static_cast<double>(k) / keyframes;
    const Eigen::Vector3d center(3 * std::cos(angle), 3 * std::sin(angle), 0.3 * draw.normal(1));
    const Sim3 error = small_similarity(draw.similarity(kSpread), center);
    for (int i = 0; i < 60; ++i) {
      in_epoch[k].push_back(center + draw.vector(0.8));
      in_joint[k].push_back(error * in_epoch[k].back());
    }
    all_epoch.insert(all_epoch.end(), in_epoch[k].begin(), in_epoch[k].end());
    all_joint.insert(all_joint.end(), in_joint[k].begin(), in_joint[k].end());
  }
  fit = umeyama(all_epoch, all_joint).y_from_x;
  std::vector<KeyframeWitness> result;
  for (size_t k = 0; k < in_epoch.size(); ++k) {
    for (Eigen::Vector3d& x : in_epoch[k]) x = fit * x;
    result.push_back(keyframe_witness(in_epoch[k], in_joint[k], ones(in_epoch[k])));
  }
  return result;
}

TEST(KeyframeWitness, FindsTheSimilarityThatIsLeft) {
  Draw draw(1);
  Points points, targets;
  for (int i = 0; i < 50; ++i) points.push_back(Eigen::Vector3d(4, 5, 6) + draw.vector(1));
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& x : points) center += x / 50;
  const Vector7 left = (Vector7() << 1, -2, 3, 4, -5, 6, 7).finished() * 1e-4;
  for (const Eigen::Vector3d& x : points) targets.push_back(small_similarity(left, center) * x);
  const KeyframeWitness witness = keyframe_witness(points, targets, ones(points));
  EXPECT_LT((witness.center - center).norm(), 1e-12);
  EXPECT_LT((witness.offset - left).norm(), 1e-5);  // second order of 1e-3
}

TEST(KeyframeWitness, TheUnitDoesNotDecideWhetherItSaysAnything) {
  Draw draw(2);
  Points points, targets;
  for (int i = 0; i < 50; ++i) points.push_back(Eigen::Vector3d(4, 5, 6) + draw.vector(1));
  for (const Eigen::Vector3d& x : points) targets.push_back(x + draw.vector(0.01));
  const Vector7 expected = keyframe_witness(points, targets, ones(points)).offset;
  ASSERT_GT(expected.norm(), 0);
  for (const double unit : {1e-9, 1e-6, 1e6}) {
    Points small = points, small_targets = targets;
    for (auto* set : {&small, &small_targets}) {
      for (Eigen::Vector3d& x : *set) x *= unit;
    }
    Vector7 found = keyframe_witness(small, small_targets, ones(small)).offset;
    found.segment<3>(3) /= unit;
    EXPECT_LT((found - expected).norm(), 1e-9) << unit;
  }
}

TEST(KeyframeWitness, TwoPointsOrALineSayNothing) {
  const Points two{{0, 0, 0}, {1, 0, 0}};
  EXPECT_EQ(keyframe_witness(two, two, ones(two)).information.norm(), 0);
  const Points line{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {5, 0, 0}};
  EXPECT_EQ(keyframe_witness(line, line, ones(line)).information.norm(), 0);
}

TEST(CoarseUncertainty, IsAsLargeAsTheErrorsThatAreMade) {
  // Monte Carlo: the truth is the identity; the normalised squared error of t2_from_t1 per degree
  // of freedom is 1 on average if the covariance is right.
  constexpr int kTrials = 300;
  double normalised = 0;
  for (uint32_t trial = 0; trial < kTrials; ++trial) {
    Draw draw(100 + trial);
    Sim3 joint_from_t1, joint_from_t2;
    const auto t1 = witnesses_of_a_fit(draw, 8, joint_from_t1);
    const auto t2 = witnesses_of_a_fit(draw, 8, joint_from_t2);
    const InitialUncertainty uncertainty = coarse_uncertainty(t1, t2, joint_from_t2);
    const Vector7 error = similarity_parameters(joint_from_t2.inverse() * joint_from_t1,
                                                uncertainty.similarity.pivot);
    normalised += error.dot(uncertainty.similarity.covariance.ldlt().solve(error)) / 7 / kTrials;
  }
  // The deviations are estimated from 16 keyframes: like Student's t, a few percent more than 1.
  EXPECT_GT(normalised, 0.8);
  EXPECT_LT(normalised, 1.3);
}

TEST(CoarseUncertainty, IsExpressedInTheFrameOfT2) {
  Draw draw(7);
  Sim3 fit1, fit2;
  const auto t1 = witnesses_of_a_fit(draw, 5, fit1);
  const auto t2 = witnesses_of_a_fit(draw, 5, fit2);
  const InitialUncertainty in_joint = coarse_uncertainty(t1, t2, Sim3{});
  Sim3 joint_from_t2;
  joint_from_t2.scale = 0.5;  // T2's units are half as long: lengths count double
  const InitialUncertainty in_t2 = coarse_uncertainty(t1, t2, joint_from_t2);
  EXPECT_NEAR(in_t2.frame.translation_u, 2 * in_joint.frame.translation_u, 1e-12);
  EXPECT_NEAR(in_t2.similarity.covariance(3, 3), 4 * in_joint.similarity.covariance(3, 3), 1e-12);
  EXPECT_NEAR(in_t2.similarity.covariance(6, 6), in_joint.similarity.covariance(6, 6), 1e-15);
}

TEST(CoarseUncertainty, OneKeyframeMeasuresNothing) {
  Draw draw(3);
  Sim3 fit;
  const auto one = witnesses_of_a_fit(draw, 1, fit);
  EXPECT_EQ(coarse_uncertainty(one, one, Sim3{}).similarity.covariance.norm(), 0);
}

}  // namespace
}  // namespace vggtcd
