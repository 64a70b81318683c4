// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/registration/metric_frame.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

#include "tests/support/test_files.h"

namespace vggtcd {
namespace {

TEST(MetricFrameFromLengths, OneLengthIsItsRatio) {
  const MetricFrame frame = metric_frame_from_lengths(std::vector<KnownLength>{{0.8, 2.0}}, 0);
  EXPECT_DOUBLE_EQ(frame.metres_from_t2.scale, 2.5);
  EXPECT_EQ(frame.metres_from_t2.rotation, Eigen::Matrix3d::Identity());
  EXPECT_FALSE(frame.scale_sigma.has_value());
}

TEST(MetricFrameFromLengths, OneLengthIsAsUncertainAsItsEndPoints) {
  const MetricFrame frame = metric_frame_from_lengths(std::vector<KnownLength>{{0.8, 2.0}}, 0.004);
  EXPECT_NEAR(frame.scale_sigma.value(), std::sqrt(2.0) * 0.004 / 0.8, 1e-12);
}

TEST(MetricFrameFromLengths, StandardErrorIsThatOfTheScatter) {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0, 0.02);
  std::uniform_real_distribution<double> length(0.5, 3.0);
  constexpr double kScale = 1.7;
  constexpr int kDraws = 2000;
  double sum = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    std::vector<KnownLength> known;
    for (int i = 0; i < 8; ++i) {
      const double metres = length(random);
      known.push_back({(metres + noise(random)) / kScale, metres});
    }
    const MetricFrame frame = metric_frame_from_lengths(known, 0);
    const double z = (frame.metres_from_t2.scale - kScale) / (frame.scale_sigma.value() * kScale);
    sum += z * z;
  }
  // E[t^2] of Student's t with 7 degrees of freedom is 7 / 5; its mean over the draws is within
  // four of its standard errors (variance of t^2: 7.84).
  EXPECT_NEAR(sum / kDraws, 1.4, 4 * std::sqrt(7.84 / kDraws));
}

TEST(MetricFrameFromLengths, RefuseLengthsThatContradictEachOther) {
  const std::vector<KnownLength> known = {{1, 2}, {1, 3.6}};
  EXPECT_ERROR(metric_frame_from_lengths(known, 0), ErrorCode::kDegenerate, "contradict");
}

const Sim3 kTruth{2.3,
                  Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix(),
                  {5, -3, 100}};

std::vector<Eigen::Vector3d> walk(double width) {
  std::vector<Eigen::Vector3d> centers;
  for (int i = 0; i < 12; ++i) {
    centers.emplace_back(0.3 * i, width * std::sin(1.1 * i), 0.5 * width * std::cos(0.7 * i));
  }
  return centers;
}

std::vector<Eigen::Vector3d> surveyed(const std::vector<Eigen::Vector3d>& centers, double sigma_m,
                                      std::mt19937& random) {
  std::normal_distribution<double> noise(0, sigma_m);
  std::vector<Eigen::Vector3d> metres;
  for (const Eigen::Vector3d& x : centers) {
    metres.push_back(kTruth * x + Eigen::Vector3d(noise(random), noise(random), noise(random)));
  }
  return metres;
}

TEST(MetricFrameFromCameras, FindsTheSimilarity) {
  std::mt19937 random(1);
  const auto centers = walk(1);
  const MetricFrame frame = metric_frame_from_cameras(centers, surveyed(centers, 0, random));
  EXPECT_NEAR(frame.metres_from_t2.scale, kTruth.scale, 1e-10);
  EXPECT_LT((frame.metres_from_t2.rotation - kTruth.rotation).norm(), 1e-10);
  EXPECT_LT((frame.metres_from_t2.translation - kTruth.translation).norm(), 1e-9);
  EXPECT_LT(frame.rms_residual_m, 1e-9);
}

TEST(MetricFrameFromCameras, StandardDeviationsAreThoseOfTheScatter) {
  std::mt19937 random(2);
  const auto centers = walk(1);
  constexpr int kDraws = 400;
  double scale = 0, position = 0;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const auto& x : centers) middle += x / static_cast<double>(centers.size());
  for (int draw = 0; draw < kDraws; ++draw) {
    const MetricFrame frame = metric_frame_from_cameras(centers, surveyed(centers, 0.05, random));
    const double z = (frame.metres_from_t2.scale / kTruth.scale - 1) / frame.scale_sigma.value();
    scale += z * z / kDraws;
    position += (frame.metres_from_t2 * middle - kTruth * middle).squaredNorm() /
                (3 * frame.position_sigma_m * frame.position_sigma_m) / kDraws;
  }
  // Student's t with 29 degrees of freedom: 29 / 27; four standard errors of 400 draws.
  EXPECT_NEAR(scale, 29.0 / 27, 4 * std::sqrt(2.5 / kDraws));
  EXPECT_NEAR(position, 29.0 / 27, 4 * std::sqrt(2.5 / (3 * kDraws)));
}

TEST(MetricFrameFromCameras, RefuseWhatDoesNotDetermineAFrame) {
  std::mt19937 random(3);
  const auto refuse = [&](const std::vector<Eigen::Vector3d>& centers, double sigma_m,
                          const char* why) {
    const auto metres = surveyed(centers, sigma_m, random);
    EXPECT_ERROR(metric_frame_from_cameras(centers, metres), ErrorCode::kDegenerate, why);
  };
  refuse({walk(1)[0], walk(1)[1]}, 0.01, "fewer than 3");
  refuse(walk(0), 0, "on a line");
  refuse(walk(0.01), 0.1, "too nearly on one line");
}

TEST(MetricFrameFromCameras, RefuseCamerasInAnotherOrder) {
  std::mt19937 random(4);
  const auto centers = walk(1);
  auto metres = surveyed(centers, 0.01, random);
  std::shuffle(metres.begin(), metres.end(), random);
  EXPECT_ERROR(metric_frame_from_cameras(centers, metres), ErrorCode::kDegenerate, "do not fit");
}

}  // namespace
}  // namespace vggtcd
