// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/registration/robust.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>
#include <vector>

#include "tests/support/toy_scene.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/registration/surface_pairs.h"

namespace vggtcd {
namespace {

using testing_support::reconstruct;

double bumps(double x, double y) { return 0.3 + 0.25 * std::sin(2 * x) * std::cos(3 * y); }
double bumps_and_box(double x, double y) {
  return x > 0.3 && x < 0.9 && std::abs(y) < 0.4 ? 0.9 : bumps(x, y);
}

// What is left between two similarities, as parameters about a point of the toy scene.
Vector7 difference(const Sim3& a, const Sim3& b) {
  return similarity_parameters(a * b.inverse(), {0.5, 0, 5});
}

const Sim3 kError = small_similarity(
    (Vector7() << 0.01, -0.008, 0.012, 0.02, 0.01, -0.03, 0.008).finished(), {0.5, 0, 5});

OrientedPoints points_of(double (*relief)(double, double), double camera_offset) {
  return oriented_points(reconstruct({.frames = 5,
                                      .width = 96,
                                      .height = 72,
                                      .camera_offset = camera_offset,
                                      .relief = relief},
                                     Sim3{}),
                         100);
}

TEST(OrientedPoints, NormalsOfAPlaneFaceTheCameras) {
  const OrientedPoints points = oriented_points(reconstruct({.frames = 3}, Sim3{}), 30);
  ASSERT_GT(points.size(), 50u);
  for (const auto& normal : points.normals)
    EXPECT_LT((normal - Eigen::Vector3f(0, 0, -1)).norm(), 1e-3);
}

TEST(AlignRobust, RemovesAnErrorInAllSevenParameters) {
  const RobustResult result =
      align_robust(points_of(bumps, 0), points_of(bumps, 0.13), {}, kError, {}, {});
  EXPECT_EQ(result.verdict, RobustVerdict::kRefined);
  EXPECT_LT(difference(result.t2_from_t1, {}).norm(), 0.1 * difference(kError, {}).norm());
  EXPECT_LT(result.cost_final, result.cost_initial);
}

TEST(AlignRobust, HasTheSameBitsForAnyNumberOfThreads) {
  const OrientedPoints t1 = points_of(bumps, 0), t2 = points_of(bumps_and_box, 0.13);
  set_num_threads(1);
  const RobustResult expected = align_robust(t1, t2, {}, kError, {}, {});
  for (const int threads : {2, 5}) {
    set_num_threads(threads);
    const RobustResult result = align_robust(t1, t2, {}, kError, {}, {});
    EXPECT_EQ(result.t2_from_t1.rotation, expected.t2_from_t1.rotation);
    EXPECT_EQ(result.t2_from_t1.translation, expected.t2_from_t1.translation);
    EXPECT_EQ(result.t2_from_t1.scale, expected.t2_from_t1.scale);
    EXPECT_EQ(result.covariance, expected.covariance);
    EXPECT_EQ(result.cost_final, expected.cost_final);
  }
  set_num_threads(2);
}

// Each point as often as it takes to have that many.
OrientedPoints repeated(const OrientedPoints& points, size_t size) {
  OrientedPoints result = points;
  while (result.size() < size) {
    result.positions.insert(result.positions.end(), points.positions.begin(),
                            points.positions.end());
    result.normals.insert(result.normals.end(), points.normals.begin(), points.normals.end());
    result.frames.insert(result.frames.end(), points.frames.begin(), points.frames.end());
  }
  return result;
}

TEST(AlignRobust, OfLargeCloudsEveryNthPointSearches) {
  const OrientedPoints t1 = repeated(points_of(bumps, 0), 120'000);
  const OrientedPoints t2 = repeated(points_of(bumps, 0.13), 120'000);
  const RobustResult result = align_robust(t1, t2, {}, kError, {}, {});
  EXPECT_TRUE(result.converged);
  const auto all = static_cast<int64_t>(t1.size() + t2.size());
  EXPECT_NEAR(static_cast<double>(result.pairs + result.rejected_far + result.rejected_normal),
              static_cast<double>(all / (all / 100'000)), 1);
  EXPECT_LT(difference(result.t2_from_t1, {}).norm(), 0.1 * difference(kError, {}).norm());
}

TEST(SurfaceMatcher, EveryNthPointFindsWhatItFindsAmongAll) {
  const OrientedPoints t1 = points_of(bumps, 0), t2 = points_of(bumps, 0.13);
  const SurfaceMatcher matcher(t1, t2);
  const std::vector<SurfacePair> all = matcher.pairs(kError);
  std::vector<SurfacePair> part;
  matcher.pairs(kError, true, 3, part);
  const size_t from_t1 = (t1.size() + 2) / 3;
  ASSERT_EQ(part.size(), from_t1 + (t2.size() + 2) / 3);
  for (size_t i = 0; i < part.size(); ++i) {
    const SurfacePair& same = all[i < from_t1 ? 3 * i : t1.size() + 3 * (i - from_t1)];
    EXPECT_EQ(part[i].moving, same.moving);
    EXPECT_EQ(part[i].fixed, same.fixed);
    EXPECT_EQ(part[i].from_t1, same.from_t1);
  }
}

TEST(AlignRobust, IsNotDrawnByAChange) {
  const RobustResult result =
      align_robust(points_of(bumps, 0), points_of(bumps_and_box, 0.13), {}, kError, {}, {});
  EXPECT_EQ(result.verdict, RobustVerdict::kRefined);
  EXPECT_LT(difference(result.t2_from_t1, {}).norm(), 0.15 * difference(kError, {}).norm());
  EXPECT_GT(result.rejected_far, 0);
}

TEST(AlignRobust, SaysThatAPlaneLeavesFourDirectionsOpen) {
  const auto flat = [](double, double) { return 0.0; };
  const RobustResult result =
      align_robust(points_of(flat, 0), points_of(flat, 0.13), {}, kError, {}, {});
  // Sliding in the plane (2), turning in it, and scaling within it.
  EXPECT_EQ(result.open_degrees_of_freedom, 4);
  EXPECT_LT(result.constrained_share[3], 0.1);  // translation x
  EXPECT_GT(result.constrained_share[5], 0.9);  // translation z, across the plane
  // What the plane does not fix stays as it was given.
  const Vector7 left = difference(result.t2_from_t1, kError);
  EXPECT_LT(left.segment<2>(3).norm(), 1e-3);
  EXPECT_NEAR(difference(result.t2_from_t1, {})[5], 0, 2e-3);
}

// Places on the plane z = 5 that every photo shows, `shift` apart along x, with noise that their
// covariances promise.
std::vector<TiePoint> ties_on_the_plane(int count, double shift) {
  constexpr double kSigma = 0.002;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-1.5, 1.5);
  std::normal_distribution<double> noise(0, kSigma);
  std::vector<TiePoint> ties;
  for (int i = 0; i < count; ++i) {
    TiePoint& tie = ties.emplace_back();
    tie.first_photo = {true, i % 5};
    tie.second_photo = {false, (i / 5) % 5};
    tie.first = {place(random), place(random), 5};
    tie.second = tie.first + Eigen::Vector3d(shift + noise(random), noise(random), noise(random));
    tie.first_covariance = tie.second_covariance =
        0.5 * kSigma * kSigma * Eigen::Matrix3d::Identity();
  }
  return ties;
}

TEST(AlignRobust, TiePointsHoldWhatAPlaneLeavesOpen) {
  const auto flat = [](double, double) { return 0.0; };
  const OrientedPoints t1 = points_of(flat, 0), t2 = points_of(flat, 0.13);
  const RobustResult result = align_robust(t1, t2, ties_on_the_plane(400, 0), kError, {}, {});
  EXPECT_EQ(result.verdict, RobustVerdict::kRefined);
  EXPECT_EQ(result.compared_by, CandidateCost::kTiePoints);
  EXPECT_THAT(result.open_motions, testing::IsEmpty());
  EXPECT_LT(difference(result.t2_from_t1, {}).norm(), 0.1 * difference(kError, {}).norm());
}

TEST(AlignRobust, AFewTiesOnWhatMovedDoNotDrawIt) {
  const OrientedPoints t1 = points_of(bumps, 0), t2 = points_of(bumps, 0.13);
  std::vector<TiePoint> ties = ties_on_the_plane(400, 0);
  const std::vector<TiePoint> moved = ties_on_the_plane(120, 0.3);
  ties.insert(ties.end(), moved.begin(), moved.end());
  const RobustResult result = align_robust(t1, t2, ties, kError, {}, {});
  EXPECT_LE(result.ties_used, 400);
  EXPECT_GT(result.ties_used, 350);
  EXPECT_LT(difference(result.t2_from_t1, {}).norm(), 0.1 * difference(kError, {}).norm());
}

TEST(AlignRobust, TooFewTiesAreChance) {
  const OrientedPoints t1 = points_of(bumps, 0), t2 = points_of(bumps, 0.13);
  const RobustResult without = align_robust(t1, t2, {}, kError, {}, {});
  const RobustResult result = align_robust(t1, t2, ties_on_the_plane(49, 0.3), kError, {}, {});
  EXPECT_EQ(result.ties, 49);
  EXPECT_EQ(result.ties_used, 0);
  EXPECT_EQ(result.compared_by, CandidateCost::kSurfaces);
  EXPECT_EQ(result.t2_from_t1.translation, without.t2_from_t1.translation);
}

TEST(AlignRobust, TiesThatContradictEachOtherAreDropped) {
  const OrientedPoints t1 = points_of(bumps, 0), t2 = points_of(bumps, 0.13);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> anywhere(-0.4, 0.4);
  std::vector<TiePoint> ties = ties_on_the_plane(400, 0);
  for (TiePoint& tie : ties) {
    tie.second += Eigen::Vector3d(anywhere(random), anywhere(random), anywhere(random));
  }
  const RobustResult without = align_robust(t1, t2, {}, kError, {}, {});
  const RobustResult result = align_robust(t1, t2, ties, kError, {}, {});
  EXPECT_EQ(result.ties, 400);
  EXPECT_EQ(result.ties_used, 0);
  EXPECT_EQ(result.compared_by, CandidateCost::kSurfaces);
  EXPECT_LT(difference(result.t2_from_t1, without.t2_from_t1).norm(),
            0.02 * difference(kError, {}).norm());
}

TEST(AlignRobust, OfTiesThatContradictEachOtherThoseCountThatAgreePairByPair) {
  const auto flat = [](double, double) { return 0.0; };
  const OrientedPoints t1 = points_of(flat, 0), t2 = points_of(flat, 0.13);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> anywhere(-0.4, 0.4);
  std::vector<TiePoint> ties = ties_on_the_plane(800, 0);
  const auto pair_of = [](const TiePoint& tie) {
    return 5 * tie.first_photo.frame + tie.second_photo.frame;
  };
  std::ranges::stable_sort(ties, {}, pair_of);  // as find_tie_points leaves them
  int64_t agreeing = 0;
  for (TiePoint& tie : ties) {
    if (tie.first_photo.frame == 2) {
      ++agreeing;
    } else {
      tie.second += Eigen::Vector3d(anywhere(random), anywhere(random), anywhere(random));
    }
  }
  const RobustResult result = align_robust(t1, t2, ties, kError, {}, {});
  EXPECT_TRUE(result.ties_contradict);
  EXPECT_EQ(result.doubts().size(), 1u);
  EXPECT_EQ(result.compared_by, CandidateCost::kTiePoints);
  EXPECT_LE(result.ties_used, agreeing);
  EXPECT_GT(result.ties_used, 0.9 * static_cast<double>(agreeing));
  EXPECT_LT(difference(result.t2_from_t1, {}).norm(), 0.2 * difference(kError, {}).norm());
}

TEST(AlignRobust, TiesAloneDoWhereSurfacesAreTooFew) {
  RobustOptions options;
  options.static_distance = 1e-4;  // hardly a pair is that near
  const OrientedPoints t1 = points_of(bumps, 0), t2 = points_of(bumps, 0.13);
  const RobustResult result = align_robust(t1, t2, ties_on_the_plane(400, 0), kError, {}, options);
  EXPECT_EQ(result.verdict, RobustVerdict::kRefined);
  EXPECT_LT(difference(result.t2_from_t1, {}).norm(), 0.15 * difference(kError, {}).norm());
  EXPECT_THAT(result.explanation, testing::HasSubstr("tie points between photos and 0 static"));
}

TEST(AlignRobust, TakesTiesWithoutPhotosErrorsAndInOneIteration) {
  const OrientedPoints t1 = points_of(bumps, 0), t2 = points_of(bumps, 0.13);
  RobustOptions options;
  options.frame_errors = false;
  const RobustResult independent =
      align_robust(t1, t2, ties_on_the_plane(400, 0), kError, {}, options);
  EXPECT_LT(difference(independent.t2_from_t1, {}).norm(), 0.1 * difference(kError, {}).norm());
  options = {};
  options.max_iterations = 1;
  const RobustResult once = align_robust(t1, t2, ties_on_the_plane(400, 0), kError, {}, options);
  EXPECT_EQ(once.iterations, 1);
  EXPECT_GT(once.pairs, 0);
}

TEST(AlignRobust, ConstrainsEverythingOnARelief) {
  const RobustResult result =
      align_robust(points_of(bumps, 0), points_of(bumps, 0.13), {}, {}, {}, {});
  EXPECT_THAT(result.open_motions, testing::IsEmpty());
  EXPECT_GT(result.constrained_share.minCoeff(), 0.5);
  EXPECT_GT(result.covariance.diagonal().minCoeff(), 0);
}

TEST(AlignRobust, KeepsTheInitialAlignmentWithTooFewPairs) {
  RobustOptions options;
  options.min_pairs = 1'000'000;
  const RobustResult result =
      align_robust(points_of(bumps, 0), points_of(bumps, 0.13), {}, kError, {}, options);
  EXPECT_EQ(result.verdict, RobustVerdict::kKeptInitialFewPairs);
  EXPECT_EQ(result.t2_from_t1.translation, kError.translation);
}

TEST(AlignRobust, EmptyCloudsKeepTheInitialAlignment) {
  EXPECT_EQ(align_robust({}, {}, {}, kError, {}, {}).verdict, RobustVerdict::kKeptInitialFewPairs);
}

TEST(RobustOptions, RefuseANormalGateOfOne) {
  RobustOptions options;
  options.min_normal_cosine = 1;
  EXPECT_THROW(options.validate(), Error);
}

}  // namespace
}  // namespace vggtcd
