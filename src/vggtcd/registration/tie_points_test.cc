// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/registration/tie_points.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "tests/support/toy_scene.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/registration/small_similarity.h"

namespace vggtcd {
namespace {

using testing_support::kT2FromT1;

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

Eigen::Vector3d in_t2(PhotoNumber photo, const Eigen::Vector3d& x) {
  return photo.of_t1 ? kT2FromT1 * x : x;
}

size_t number_of_true(const std::vector<TiePoint>& ties) {
  return static_cast<size_t>(std::count_if(ties.begin(), ties.end(), [](const TiePoint& tie) {
    constexpr double kTwoPixels = 2 * 5 / (0.9 * 192);  // in the scene, at its depth
    return (in_t2(tie.first_photo, tie.first) - in_t2(tie.second_photo, tie.second)).norm() <
           kT2FromT1.scale * kTwoPixels;
  }));
}

TEST(FindTiePoints, FindsPlacesThatBothEpochsShow) {
  const auto ties = find_tie_points(textured_before(), textured_after(), nearly(), 5);
  EXPECT_GT(ties.size(), 400u);
  EXPECT_GT(number_of_true(ties), ties.size() * 9 / 10);
  std::set<std::pair<bool, bool>> epochs;
  for (const TiePoint& tie : ties) {
    epochs.insert({tie.first_photo.of_t1, tie.second_photo.of_t1});
    for (const PhotoNumber photo : {tie.first_photo, tie.second_photo}) {
      EXPECT_TRUE(photo.frame >= 0 && photo.frame < 5);
    }
    EXPECT_TRUE(tie.across() || tie.first_photo.frame < tie.second_photo.frame);
  }
  // Between the epochs, T1's photo first, and within either.
  EXPECT_EQ(epochs, (std::set<std::pair<bool, bool>>{{true, false}, {true, true}, {false, false}}));
}

size_t number_across(const std::vector<TiePoint>& ties) {
  return static_cast<size_t>(
      std::count_if(ties.begin(), ties.end(), [](const TiePoint& tie) { return tie.across(); }));
}

TEST(FindTiePoints, FindsFewBetweenPlacesThatHaveNothingInCommon) {
  const auto elsewhere = [](double x, double y) {
    return testing_support::mottled(x + 31.7, y - 58.3);
  };
  const auto ties =
      find_tie_points(textured_before(), epoch(0.13, kT2FromT1, elsewhere), nearly(), 5);
  const auto true_ties = find_tie_points(textured_before(), textured_after(), nearly(), 5);
  EXPECT_LT(number_across(ties), number_across(true_ties) / 4);
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
    EXPECT_EQ(tie.first_photo.frame % 4, 0);
    EXPECT_EQ(tie.second_photo.frame % 4, 0);
  }
}

TEST(FindTiePoints, PixelsAreSurerThanDepths) {
  const auto ties = find_tie_points(textured_before(), textured_after(), nearly(), 5);
  ASSERT_FALSE(ties.empty());
  const auto check_point = [](PhotoNumber photo, const Eigen::Vector3d& x,
                              const Eigen::Matrix3d& covariance) {
    const Reconstruction& epoch = photo.of_t1 ? textured_before() : textured_after();
    const Eigen::Vector3d ray =
        x - camera_center(epoch.views[static_cast<size_t>(photo.frame)].camera_from_world);
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(covariance);
    EXPECT_GT(std::abs(axes.eigenvectors().col(2).dot(ray.normalized())), 1 - 1e-9);
    // 5 % of the distance along the ray; 0.7 px across it.
    EXPECT_NEAR(std::sqrt(axes.eigenvalues()[2]) / ray.norm(), 0.05, 1e-9);
    EXPECT_NEAR(std::sqrt(axes.eigenvalues()[0]) / ray.norm(), 0.7 / (0.9 * 192), 1e-9);
  };
  for (const TiePoint& tie : ties) {
    check_point(tie.first_photo, tie.first, tie.first_covariance);
    check_point(tie.second_photo, tie.second, tie.second_covariance);
  }
}

TEST(FindTiePoints, LeavesOutWhatHasNoDepth) {
  Reconstruction before = textured_before();
  std::fill(before.depth.begin(), before.depth.begin() + 4 * 192 * 144, 0.0f);
  const auto ties = find_tie_points(before, textured_after(), nearly(), 5);
  ASSERT_FALSE(ties.empty());
  for (const TiePoint& tie : ties) {
    EXPECT_TRUE(!tie.first_photo.of_t1 || tie.first_photo.frame == 4);
  }
}

TEST(FindTiePoints, AreTheSameForAnyNumberOfThreads) {
  set_num_threads(1);
  const auto expected = find_tie_points(textured_before(), textured_after(), nearly(), 5);
  set_num_threads(3);
  const auto actual = find_tie_points(textured_before(), textured_after(), nearly(), 5);
  set_num_threads(2);
  ASSERT_EQ(actual.size(), expected.size());
  for (size_t i = 0; i < actual.size(); ++i) {
    EXPECT_EQ(actual[i].first, expected[i].first);
    EXPECT_EQ(actual[i].second, expected[i].second);
    EXPECT_EQ(actual[i].second_covariance, expected[i].second_covariance);
  }
}

}  // namespace
}  // namespace vggtcd
