// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/registration/tie_points.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "tests/support/toy_scene.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/registration/small_similarity.h"

namespace vggtcd {
namespace {

using testing_support::kT2FromT1;
using testing_support::ToyScene;

double bumps(double x, double y) { return 0.3 + 0.25 * std::sin(2 * x) * std::cos(3 * y); }

Reconstruction epoch(double camera_offset, const Sim3& frame_from_scene,
                     uint8_t (*gray)(double, double) = testing_support::mottled) {
  return testing_support::reconstruct({.frames = 5,
                                       .width = 192,
                                       .height = 144,
                                       .camera_offset = camera_offset,
                                       .relief = bumps,
                                       .gray = gray},
                                      frame_from_scene);
}

const Reconstruction& textured_before() {
  static const Reconstruction reconstruction = epoch(0, Sim3{});
  return reconstruction;
}
const Reconstruction& textured_after() {
  static const Reconstruction reconstruction = epoch(0.13, kT2FromT1);
  return reconstruction;
}

// Off by about five pixels.
Sim3 nearly() {
  const Vector7 error = (Vector7() << 0.01, -0.01, 0.02, 0.05, 0.03, 0.04, 0.01).finished();
  return kT2FromT1 * small_similarity(error, {0.5, 0, 5});
}

size_t number_of_true(const std::vector<TiePoint>& ties) {
  return static_cast<size_t>(std::count_if(ties.begin(), ties.end(), [](const TiePoint& tie) {
    constexpr double kTwoPixels = 2 * 5 / (0.9 * 192);  // in the scene, at its depth
    return (kT2FromT1 * tie.in_t1 - tie.in_t2).norm() < kT2FromT1.scale * kTwoPixels;
  }));
}

TEST(FindTiePoints, FindsPlacesThatBothEpochsShow) {
  const auto ties = find_tie_points(textured_before(), textured_after(), nearly(), 5);
  EXPECT_GT(ties.size(), 200u);
  EXPECT_GT(number_of_true(ties), ties.size() * 9 / 10);
  for (const TiePoint& tie : ties) {
    EXPECT_TRUE(tie.frame_t1 >= 0 && tie.frame_t1 < 5 && tie.frame_t2 >= 0 && tie.frame_t2 < 5);
  }
}

TEST(FindTiePoints, FindsThemInAnotherLight) {
  const auto dim = [](double x, double y) {
    return static_cast<uint8_t>(0.5 * testing_support::mottled(x, y) + 15);
  };
  const auto ties = find_tie_points(textured_before(), epoch(0.13, kT2FromT1, dim), nearly(), 5);
  EXPECT_GT(ties.size(), 100u);
  EXPECT_GT(number_of_true(ties), ties.size() * 9 / 10);
}

TEST(FindTiePoints, FindsNoneOnABlankWall) {
  const auto blank = [](double, double) { return uint8_t{128}; };
  EXPECT_TRUE(
      find_tie_points(epoch(0, Sim3{}, blank), epoch(0.13, kT2FromT1, blank), nearly(), 5).empty());
}

TEST(FindTiePoints, LooksAtNoMorePhotosThanAskedFor) {
  const auto ties = find_tie_points(textured_before(), textured_after(), nearly(), 2);
  ASSERT_FALSE(ties.empty());
  for (const TiePoint& tie : ties) {  // the first and the last
    EXPECT_EQ(tie.frame_t1 % 4, 0);
    EXPECT_EQ(tie.frame_t2 % 4, 0);
  }
}

TEST(FindTiePoints, PixelsAreSurerThanDepths) {
  const Reconstruction& before = textured_before();
  for (const TiePoint& tie : find_tie_points(before, textured_after(), nearly(), 5)) {
    const Eigen::Vector3d ray =
        tie.in_t1 -
        camera_center(before.views[static_cast<size_t>(tie.frame_t1)].camera_from_world);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(tie.covariance_t1);
    EXPECT_GT(std::abs(axes.eigenvectors().col(2).dot(ray.normalized())), 1 - 1e-9);
    // 5 % of the distance along the ray; 0.7 px across it.
    EXPECT_NEAR(std::sqrt(axes.eigenvalues()[2]) / ray.norm(), 0.05, 1e-9);
    EXPECT_NEAR(std::sqrt(axes.eigenvalues()[0]) / ray.norm(), 0.7 / (0.9 * 192), 1e-9);
  }
}

TEST(FindTiePoints, LeavesOutWhatHasNoDepth) {
  Reconstruction before = textured_before();
  std::fill(before.depth.begin(), before.depth.begin() + 4 * 192 * 144, 0.0f);
  const auto ties = find_tie_points(before, textured_after(), nearly(), 5);
  ASSERT_FALSE(ties.empty());
  for (const TiePoint& tie : ties) EXPECT_EQ(tie.frame_t1, 4);
}

TEST(FindTiePoints, AreTheSameForAnyNumberOfThreads) {
  set_num_threads(1);
  const auto expected = find_tie_points(textured_before(), textured_after(), nearly(), 5);
  set_num_threads(3);
  const auto actual = find_tie_points(textured_before(), textured_after(), nearly(), 5);
  set_num_threads(2);
  ASSERT_EQ(actual.size(), expected.size());
  for (size_t i = 0; i < actual.size(); ++i) {
    EXPECT_EQ(actual[i].in_t1, expected[i].in_t1);
    EXPECT_EQ(actual[i].in_t2, expected[i].in_t2);
    EXPECT_EQ(actual[i].covariance_t2, expected[i].covariance_t2);
  }
}

}  // namespace
}  // namespace vggtcd
