// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/registration/plausibility.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "tests/support/toy_scene.h"
#include "vggtcd/core/parallel.h"

namespace vggtcd {
namespace {

using testing_support::flat_relief;
using testing_support::kT2FromT1;
using testing_support::reconstruct;
using testing_support::ToyScene;

double ridges(double x, double y) { return 0.45 + 0.45 * std::sin(1.3 * x) * std::cos(0.9 * y); }
double other_ridges(double x, double y) { return 0.45 + 0.45 * std::cos(1.9 * x + 2 * y); }

struct Epochs {
  Reconstruction before, after;
};
Epochs epochs(double (*before)(double, double), double (*after)(double, double)) {
  return {reconstruct({.frames = 6, .relief = before}, Sim3{}),
          reconstruct({.frames = 6, .camera_offset = 0.2, .relief = after}, kT2FromT1)};
}

PlausibilityResult verdict_on(const Epochs& e, const Sim3& t2_from_t1) {
  return judge_plausibility(surface_agreement(e.before, e.after, t2_from_t1), {});
}

TEST(SurfaceAgreement, IsKappaOfWhatAgreesAndWhatChanceWould) {
  EXPECT_DOUBLE_EQ((SurfaceAgreement{.agreeing = 0.6, .by_chance = 0.2}.above_chance()), 0.5);
  EXPECT_DOUBLE_EQ((SurfaceAgreement{.agreeing = 0.2, .by_chance = 0.2}.above_chance()), 0);
  EXPECT_DOUBLE_EQ((SurfaceAgreement{.agreeing = 1, .by_chance = 1}.above_chance()), 1);
}

TEST(SurfaceAgreement, AllOfARightAlignmentAgrees) {
  const Epochs e = epochs(ridges, ridges);
  const SurfaceAgreement found = surface_agreement(e.before, e.after, kT2FromT1);
  EXPECT_GT(found.agreeing, 0.97);
  EXPECT_GT(found.seen_share_t1, 0.9);
  EXPECT_GT(found.seen_share_t2, 0.9);
}

TEST(SurfaceAgreement, ChanceIsHowOftenTwoPixelsOfThePhotoAreEquallyDeep) {
  // One photo, and itself as the other epoch.
  Reconstruction photo = reconstruct({.frames = 1, .relief = ridges}, Sim3{});
  std::ranges::fill(photo.confidence, 1.0f);
  const SurfaceAgreement found = surface_agreement(photo, photo, Sim3{});
  std::vector<double> depths;  // of the centres of 16 x 16 fields
  for (int row = 0; row < 16; ++row) {
    for (int column = 0; column < 16; ++column) {
      const int u = static_cast<int>((column + 0.5) * photo.width / 16);
      const int v = static_cast<int>((row + 0.5) * photo.height / 16);
      depths.push_back(static_cast<double>(photo.depth[static_cast<size_t>(v * photo.width + u)]));
    }
  }
  int same = 0;
  for (const double a : depths) {
    for (const double b : depths) same += std::abs(b - a) < kSameDepth * a ? 1 : 0;
  }
  EXPECT_EQ(found.pairs, 2 * 256);
  EXPECT_EQ(found.agreeing, 1);
  EXPECT_NEAR(found.by_chance, same / (256.0 * 256.0), 1e-3);  // depths at the very edge
}

TEST(SurfaceAgreement, IsTheSameForAnyNumberOfThreads) {
  const Epochs e = epochs(ridges, other_ridges);
  set_num_threads(1);
  const SurfaceAgreement one = surface_agreement(e.before, e.after, kT2FromT1);
  set_num_threads(5);
  const SurfaceAgreement five = surface_agreement(e.before, e.after, kT2FromT1);
  set_num_threads(2);
  EXPECT_EQ(one.agreeing, five.agreeing);
  EXPECT_EQ(one.by_chance, five.by_chance);
}

TEST(JudgePlausibility, BelievesARightAlignment) {
  EXPECT_EQ(verdict_on(epochs(ridges, ridges), kT2FromT1).verdict, Plausibility::kBelievable);
}

TEST(JudgePlausibility, BelievesAWallAlthoughAllItsDepthsAgreeByChance) {
  const PlausibilityResult result = verdict_on(epochs(flat_relief, flat_relief), kT2FromT1);
  EXPECT_GT(result.surfaces.by_chance, 0.7);
  EXPECT_EQ(result.verdict, Plausibility::kBelievable);
}

TEST(JudgePlausibility, RefusesThreeTimesTheScale) {
  Sim3 wrong = kT2FromT1;
  wrong.scale *= 3;
  const PlausibilityResult result = verdict_on(epochs(ridges, ridges), wrong);
  EXPECT_EQ(result.verdict, Plausibility::kSurfacesDisagree);
  EXPECT_TRUE(result.refused());
}

TEST(JudgePlausibility, RefusesTheInverse) {
  EXPECT_TRUE(verdict_on(epochs(ridges, ridges), kT2FromT1.inverse()).refused());
}

TEST(JudgePlausibility, RefusesATurnByHalfACircleForWantOfOverlap) {
  const Sim3 turned{
      1,
      Eigen::AngleAxisd(3.14159265358979, Eigen::Vector3d::UnitY()).toRotationMatrix(),
      {0, 0, 0}};
  const PlausibilityResult result = verdict_on(epochs(ridges, ridges), kT2FromT1 * turned);
  EXPECT_EQ(result.verdict, Plausibility::kNoOverlap);
  EXPECT_THAT(result.explanation, testing::HasSubstr("0.0 % of the before epoch's points"));
}

TEST(JudgePlausibility, DoubtsWhatIsLittleBetterThanChanceButDoesNotRefuseIt) {
  SurfaceAgreement surfaces{0.9, 0.9, 10000, 0.35, 0.1};
  const PlausibilityResult doubtful = judge_plausibility(surfaces, {});
  EXPECT_EQ(doubtful.verdict, Plausibility::kDoubtful);
  EXPECT_FALSE(doubtful.refused());
  surfaces.agreeing = 0.45;
  EXPECT_EQ(judge_plausibility(surfaces, {}).verdict, Plausibility::kBelievable);
  surfaces.agreeing = 0.25;
  EXPECT_EQ(judge_plausibility(surfaces, {}).verdict, Plausibility::kSurfacesDisagree);
  surfaces.pairs = 20;  // too few to say anything
  EXPECT_EQ(judge_plausibility(surfaces, {}).verdict, Plausibility::kNoOverlap);
}

// T1's frames, then T2's, of reconstructions in the frame of `joint_from_scene`.
JointReconstruction joint_of(const std::vector<Reconstruction>& epochs) {
  JointReconstruction joint;
  Reconstruction& all = joint.reconstruction;
  all.width = epochs[0].width;
  all.height = epochs[0].height;
  for (const Reconstruction& epoch : epochs) {
    all.views.insert(all.views.end(), epoch.views.begin(), epoch.views.end());
    all.depth.insert(all.depth.end(), epoch.depth.begin(), epoch.depth.end());
    all.confidence.insert(all.confidence.end(), epoch.confidence.begin(), epoch.confidence.end());
    all.color.insert(all.color.end(), epoch.color.begin(), epoch.color.end());
  }
  joint.keyframes_t1 = joint.keyframes_t2 = {0, 1, 2, 3, 4, 5};
  return joint;
}

class JointVerdict : public testing::Test {
 protected:
  PlausibilityResult verdict(const JointReconstruction& joint) const {
    const CoarseResult coarse = align_coarse(epochs_.before, epochs_.after, joint, {});
    return judge_plausibility(surface_agreement(epochs_.before, epochs_.after, coarse.t2_from_t1),
                              coarse);
  }
  static std::vector<Reconstruction> in_joint(double (*relief)(double, double)) {
    return {reconstruct({.frames = 6, .relief = relief}, kJointFromScene),
            reconstruct({.frames = 6, .camera_offset = 0.2, .relief = relief}, kJointFromScene)};
  }

  static inline const Sim3 kJointFromScene{0.4, Eigen::Matrix3d::Identity(), {5, 0, 0}};
  Epochs epochs_ = epochs(ridges, ridges);
};

TEST_F(JointVerdict, BelievesTheJointPassOfTheEpochs) {
  const PlausibilityResult result = verdict(joint_of(in_joint(ridges)));
  EXPECT_EQ(result.verdict, Plausibility::kBelievable);
  EXPECT_LT(*result.joint_unexplained_t1, 1e-6);
}

TEST_F(JointVerdict, RefusesReversedKeyframesAndNamesTheEpoch) {
  JointReconstruction joint = joint_of(in_joint(ridges));
  joint.keyframes_t2 = {5, 4, 3, 2, 1, 0};
  const PlausibilityResult result = verdict(joint);
  EXPECT_EQ(result.verdict, Plausibility::kJointDisagrees);
  EXPECT_THAT(result.explanation, testing::HasSubstr("keyframes of the after epoch"));
}

TEST_F(JointVerdict, RefusesTwoPlacesThatAFakeJointPassPutsTogether) {
  epochs_ = epochs(ridges, other_ridges);
  const JointReconstruction fake = joint_of({in_joint(ridges)[0], in_joint(other_ridges)[1]});
  const PlausibilityResult result = verdict(fake);
  EXPECT_LT(*result.joint_unexplained_t2, 1e-6);  // it fits each epoch
  EXPECT_TRUE(result.refused());
}

}  // namespace
}  // namespace vggtcd
