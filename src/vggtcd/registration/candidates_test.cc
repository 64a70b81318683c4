// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/registration/candidates.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/toy_scene.h"

namespace vggtcd {
namespace {

double bumps(double x, double y) { return 0.3 + 0.25 * std::sin(2 * x) * std::cos(3 * y); }

Reconstruction epoch(double camera_offset) {
  return testing_support::reconstruct(
      {.frames = 5, .width = 96, .height = 72, .camera_offset = camera_offset, .relief = bumps},
      Sim3{});
}

FineResult refined(const Sim3& t2_from_t1) {
  FineResult fine;
  fine.t2_from_t1 = t2_from_t1;
  fine.verdict = FineVerdict::kRefined;
  return fine;
}

Sim3 shifted(double x) {
  Sim3 result;
  result.translation.x() = x;
  return result;
}

TEST(ChooseAlignment, TakesTheSmallestCostAndLeavesAWrongStageBehind) {
  RobustOptions options;
  options.robust_grid_resolution = 100;
  // The epochs are in one frame: the truth is the identity. Algorithm 1 claims to be 0.5 off.
  const AlignmentChoice choice = choose_alignment(
      epoch(0), epoch(0.1), {{"coarse", shifted(0.03), 0}, {}}, refined(shifted(0.5)), options);
  ASSERT_EQ(choice.candidates.size(), 3u);
  const auto best = std::min_element(
      choice.candidates.begin(), choice.candidates.end(),
      [](const AlignmentCandidate& a, const AlignmentCandidate& b) { return a.cost < b.cost; });
  EXPECT_EQ(choice.chosen, best->name);
  EXPECT_NE(choice.chosen, "fine");
  EXPECT_EQ(choice.t2_from_t1.translation, best->t2_from_t1.translation);
  EXPECT_LT((choice.t2_from_t1 * Eigen::Vector3d(0, 0, 5) - Eigen::Vector3d(0, 0, 5)).norm(), 0.01);
}

TEST(ChooseAlignment, GoesByTiePointsWherePhotosShowPlacesThatCanBeRecognised) {
  // A plane: surfaces alone cannot tell that the start is off along it.
  const auto plane = [](double camera_offset) {
    return testing_support::reconstruct({.frames = 5,
                                         .width = 192,
                                         .height = 144,
                                         .camera_offset = camera_offset,
                                         .gray = testing_support::mottled},
                                        Sim3{});
  };
  const RobustStart start{{"coarse", shifted(0.03), 0}, {}};
  const AlignmentChoice choice = choose_alignment(plane(0), plane(0.1), start, {}, {});
  EXPECT_EQ(choice.chosen, "robust");
  EXPECT_EQ(choice.robust.compared_by, CandidateCost::kTiePoints);
  EXPECT_LT((choice.t2_from_t1 * Eigen::Vector3d(0, 0, 5) - Eigen::Vector3d(0, 0, 5)).norm(),
            0.005);
  RobustOptions without;
  without.tie_points = false;
  const AlignmentChoice slid = choose_alignment(plane(0), plane(0.1), start, {}, without);
  EXPECT_NEAR(slid.t2_from_t1.translation.x(), 0.03, 0.01);
}

TEST(ChooseAlignment, IsNotDrawnByPlacesThatOnlyLookAlike) {
  // The same relief, papered anew: what photos show alike is chance.
  const auto papered = [](double camera_offset, uint8_t (*gray)(double, double)) {
    return testing_support::reconstruct({.frames = 5,
                                         .width = 192,
                                         .height = 144,
                                         .camera_offset = camera_offset,
                                         .relief = bumps,
                                         .gray = gray},
                                        Sim3{});
  };
  const auto anew = [](double x, double y) { return testing_support::mottled(x + 31.7, y - 58.3); };
  const AlignmentChoice choice =
      choose_alignment(papered(0, testing_support::mottled), papered(0.1, anew),
                       {{"coarse", shifted(0.03), 0}, {}}, {}, {});
  EXPECT_EQ(choice.robust.compared_by, CandidateCost::kSurfaces);
  EXPECT_LT((choice.t2_from_t1 * Eigen::Vector3d(0, 0, 5) - Eigen::Vector3d(0, 0, 5)).norm(),
            0.005);
}

TEST(ChooseAlignment, KeepsTheInitialOneWhereThereIsTooLittleSurface) {
  RobustOptions options;
  options.min_pairs = 1 << 30;
  options.tie_points = false;
  const AlignmentChoice choice = choose_alignment(
      epoch(0), epoch(0.1), {{"initial", shifted(0.03), 0}, {}}, refined(shifted(0)), options);
  EXPECT_EQ(choice.chosen, "initial");
  EXPECT_EQ(choice.candidates.size(), 1u);
  EXPECT_EQ(choice.t2_from_t1.translation, shifted(0.03).translation);
  EXPECT_EQ(choice.verdict, "kept_initial_few_pairs");
}

}  // namespace
}  // namespace vggtcd
