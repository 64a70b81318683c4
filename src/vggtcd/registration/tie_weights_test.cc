// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/registration/tie_weights.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <random>

namespace vggtcd {
namespace {

const Sim3 kT2FromT1{
    2.0, Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitY()).toRotationMatrix(), {1, -2, 0.5}};

// Ties of two photos each, with errors drawn from their own covariances.
std::vector<TiePoint> draws(int count) {
  std::mt19937 engine(11);
  std::normal_distribution<double> normal;
  const auto vector = [&] {
    return Eigen::Vector3d(normal(engine), normal(engine), normal(engine));
  };
  std::vector<TiePoint> ties;
  for (int i = 0; i < count; ++i) {
    TiePoint& tie = ties.emplace_back();
    tie.first_photo = {true, i % 2};
    tie.second_photo = {false, (i / 2) % 2};
    const Eigen::Vector3d axis = vector().normalized();
    tie.first_covariance = 1e-4 * (Eigen::Matrix3d::Identity() + 20 * axis * axis.transpose());
    tie.second_covariance = 4e-4 * (Eigen::Matrix3d::Identity() + 9 * axis * axis.transpose());
    const Eigen::Matrix3d root1 = tie.first_covariance.llt().matrixL();
    const Eigen::Matrix3d root2 = tie.second_covariance.llt().matrixL();
    const Eigen::Vector3d x = 3 * vector();
    tie.first = x + root1 * vector();
    tie.second = kT2FromT1 * x + root2 * vector();
  }
  return ties;
}

TEST(WeighTies, VarianceIsOneWhereTiesErrAsTheyPromise) {
  const auto ties = draws(4000);
  const WeighedTies weighed = weigh_ties(ties, kT2FromT1, nullptr, Vector7::Zero());
  EXPECT_NEAR(weighed.variance, 1, 0.1);
  EXPECT_GT(weighed.used, 3980);
  // The information is the inverse covariance of the difference, times a weight of at most 1.
  const Eigen::Matrix3d axes = kT2FromT1.scale * kT2FromT1.rotation;
  const Eigen::Matrix3d promised =
      (axes * ties[0].first_covariance * axes.transpose() + ties[0].second_covariance).inverse();
  const double weight = weighed.points[0].information.trace() * weighed.variance / promised.trace();
  EXPECT_LT((weighed.points[0].information * weighed.variance - weight * promised).norm(),
            1e-9 * promised.norm());
  EXPECT_GT(weight, 0);
  EXPECT_LE(weight, 1);
}

TEST(WeighTies, OutliersCountNothing) {
  auto ties = draws(1000);
  for (size_t i = 0; i < 300; ++i) ties[i].second += Eigen::Vector3d(3, -2, 1);
  const WeighedTies weighed = weigh_ties(ties, kT2FromT1, nullptr, Vector7::Zero());
  for (size_t i = 0; i < 300; ++i) EXPECT_EQ(weighed.points[i].information.norm(), 0) << i;
  EXPECT_GT(weighed.used, 650);
  EXPECT_LE(weighed.used, 700);
}

TEST(WeighTies, WhatAPhotoErrsAsAWholeIsTakenOffBefore) {
  // Photo 1 of T1 shows everything a unit too far along x. It errs by theta and by itself.
  auto ties = draws(1000);
  for (TiePoint& tie : ties) {
    if (tie.first_photo.frame == 1) tie.second += Eigen::Vector3d(1, 0, 0);
  }
  PhotoErrors photos;
  photos.centers.assign(4, Eigen::Vector3d(0.3, 0.2, 0.1));
  photos.groups = PhotoGroups({2, 2});
  photos.known.assign(4, true);
  photos.mean = Eigen::VectorXd::Zero(28);
  photos.response = Eigen::MatrixXd::Zero(28, 7);
  photos.mean[7 + 3] = 0.4;
  photos.response(7 + 3, 3) = 2;
  const WeighedTies weighed =
      weigh_ties(ties, kT2FromT1, &photos, 0.3 * Vector7::Unit(3));  // 0.4 + 2 * 0.3
  EXPECT_GT(weighed.used, 990);
  EXPECT_NEAR(weighed.variance, 1, 0.2);
  EXPECT_GT(weigh_ties(ties, kT2FromT1, nullptr, Vector7::Zero()).variance, 20);
}

TEST(WeighTies, TiesOfOneEpochAreMappedWhole) {
  for (const bool of_t1 : {true, false}) {
    TiePoint tie = draws(1)[0];
    tie.first_photo = {of_t1, 0};
    tie.second_photo = {of_t1, 1};
    tie.second = tie.first + Eigen::Vector3d(0.01, 0, 0);
    tie.first_covariance = tie.second_covariance = 1e-4 * Eigen::Matrix3d::Identity();
    const std::vector<TiePoint> ties(3, tie);
    const PointPair point = weigh_ties(ties, kT2FromT1, nullptr, Vector7::Zero()).points[0];
    const double scale = of_t1 ? kT2FromT1.scale : 1;
    EXPECT_NEAR((point.first - point.second).norm(), 0.01 * scale, 1e-12);
    EXPECT_LT((point.first - (of_t1 ? kT2FromT1 * tie.first : tie.first)).norm(), 1e-12);
  }
}

TEST(WeighTies, NoTiesWeighNothing) {
  const WeighedTies weighed = weigh_ties({}, kT2FromT1, nullptr, Vector7::Zero());
  EXPECT_TRUE(weighed.points.empty());
  EXPECT_EQ(weighed.used, 0);
}

TEST(TieCost, IsLeastAtTheTruth) {
  const auto ties = draws(500);
  const double truth = tie_cost(ties, kT2FromT1, 1);
  EXPECT_GT(truth, 0);
  EXPECT_LT(truth, 0.3);
  for (int k = 0; k < 7; ++k) {
    const Sim3 off = small_similarity(0.05 * Vector7::Unit(k), {0, 0, 0}) * kT2FromT1;
    EXPECT_GT(tie_cost(ties, off, 1), truth) << k;
  }
  Sim3 far = kT2FromT1;
  far.translation.x() += 100;
  EXPECT_EQ(tie_cost(ties, far, 1), 1);
}

TEST(AgreeingTies, AreThoseNearTheMedianOfTheirPairOfPhotos) {
  std::vector<TiePoint> ties = draws(400);
  // One photo after the other, as find_tie_points leaves them.
  std::ranges::stable_sort(ties, {}, [](const TiePoint& tie) {
    return 2 * tie.first_photo.frame + tie.second_photo.frame;
  });
  const auto photos = [](const TiePoint& tie) {
    return std::pair(tie.first_photo.frame, tie.second_photo.frame);
  };
  std::mt19937 engine(5);
  std::uniform_real_distribution<double> anywhere(-4, 4);
  size_t expected = 0;
  for (size_t i = 0; i < ties.size(); ++i) {
    if (photos(ties[i]) == std::pair(0, 0)) {
      ties[i].second += Eigen::Vector3d(2, 1, -3);  // both photos err, and agree
      if (i % 10 == 0) {
        ties[i].second += Eigen::Vector3d(9, 9, 9);
      } else {
        ++expected;
      }
    } else if (photos(ties[i]) == std::pair(0, 1)) {
      ties[i].second += Eigen::Vector3d(anywhere(engine), anywhere(engine), anywhere(engine));
    } else {
      ++expected;
    }
  }
  const std::vector<TiePoint> kept = agreeing_ties(ties, kT2FromT1);
  EXPECT_EQ(kept.size(), expected);
  for (const TiePoint& tie : kept) EXPECT_NE(photos(tie), std::pair(0, 1));
  EXPECT_TRUE(agreeing_ties(std::span(ties).first(5), kT2FromT1).empty());  // five may be chance
}

}  // namespace
}  // namespace vggtcd
