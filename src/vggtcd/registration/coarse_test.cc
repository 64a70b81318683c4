// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/registration/coarse.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/support/toy_scene.h"

namespace vggtcd {
namespace {

using testing_support::reconstruct;
using testing_support::ToyScene;

Sim3 similarity(double scale, double angle_rad, const Eigen::Vector3d& axis,
                const Eigen::Vector3d& t) {
  return {scale, Eigen::AngleAxisd(angle_rad, axis.normalized()).toRotationMatrix(), t};
}

void expect_near(const Sim3& a, const Sim3& b, double tolerance) {
  EXPECT_NEAR(a.scale / b.scale, 1.0, tolerance);
  EXPECT_LT((a.rotation - b.rotation).norm(), tolerance);
  EXPECT_LT((a.translation - b.translation).norm(), tolerance * (1 + b.translation.norm()));
}

const Sim3 kT1FromScene = similarity(0.7, 0.5, {1, 1, 0}, {1, 2, 3});
const Sim3 kT2FromScene = similarity(1.9, -1.5, {0, 1, 2}, {-4, 0, 1});
const Sim3 kJointFromScene = similarity(0.3, 2.5, {1, 0, 1}, {0, -1, 5});

double bumps(double x, double y) { return 0.3 * std::sin(2 * x) * std::cos(3 * y) + 0.3; }

// Frames `numbers` of a reconstruction of `scene` in the joint frame, appended to `joint`.
void append_frames(Reconstruction& joint, const ToyScene& scene, const std::vector<int>& numbers) {
  const Reconstruction all = reconstruct(scene, kJointFromScene);
  joint.width = all.width;
  joint.height = all.height;
  for (const int frame : numbers) {
    joint.views.push_back(all.views[static_cast<size_t>(frame)]);
    const auto append = [](auto& to, auto from) { to.insert(to.end(), from.begin(), from.end()); };
    append(joint.depth, all.frame_depth(frame));
    append(joint.confidence, all.frame_confidence(frame));
    append(joint.color, all.frame_color(frame));
  }
}

struct Epochs {
  ToyScene before_scene{.frames = 6, .relief = bumps};
  ToyScene after_scene{.frames = 5, .camera_offset = 0.3, .relief = bumps};
  Reconstruction before = reconstruct(before_scene, kT1FromScene);
  Reconstruction after = reconstruct(after_scene, kT2FromScene);
  JointReconstruction joint;
  Epochs() {
    joint.keyframes_t1 = {0, 3, 5};
    joint.keyframes_t2 = {0, 4};
    append_frames(joint.reconstruction, before_scene, joint.keyframes_t1);
    append_frames(joint.reconstruction, after_scene, joint.keyframes_t2);
  }
};

TEST(ComposeThroughJoint, IsT1ToJointThenBackToT2) {
  const Sim3 joint_from_t1 = kJointFromScene * kT1FromScene.inverse();
  const Sim3 joint_from_t2 = kJointFromScene * kT2FromScene.inverse();
  expect_near(compose_through_joint(joint_from_t1, joint_from_t2),
              joint_from_t2.inverse() * joint_from_t1, 1e-12);
}

TEST(AlignCoarse, RecoversTheSimilarityOfExactReconstructions) {
  const Epochs e;
  const CoarseResult result = align_coarse(e.before, e.after, e.joint, {});
  // Points are float: 1e-6 of their size; the fit averages over thousands of them.
  expect_near(result.t1.joint_from_epoch, kJointFromScene * kT1FromScene.inverse(), 1e-5);
  expect_near(result.t2_from_t1, kT2FromScene * kT1FromScene.inverse(), 1e-5);
  EXPECT_LT(result.t1.rms_residual_u, 1e-5);
}

// What one sure pixel of a keyframe makes of the alignment when its depth is multiplied.
CoarseResult with_one_pixel(float factor) {
  Epochs e;
  const size_t sure = static_cast<size_t>(std::ranges::max_element(e.before.confidence) -
                                          e.before.confidence.begin());
  const size_t in_first_frame = sure % e.before.pixels_per_frame();
  e.before.depth[in_first_frame] *= factor;
  e.before.confidence[in_first_frame] *= 2;
  return align_coarse(e.before, e.after, e.joint, {});
}

TEST(AlignCoarse, OnePixelFarAwayDecidesNothing) {
  const int64_t all = with_one_pixel(1).t1.correspondences;
  for (const float factor : {0.001f, 0.3f, 3.5f, 100.0f, 1e8f}) {
    const CoarseResult result = with_one_pixel(factor);
    EXPECT_EQ(result.t1.correspondences, all - 1) << factor;
    expect_near(result.t2_from_t1, kT2FromScene * kT1FromScene.inverse(), 1e-5);
    EXPECT_LT(result.t1.unexplained_share, 1e-8) << factor;
  }
}

TEST(AlignCoarse, APassOfOtherDepthsStaysOneThatDoesNotFit) {
  Epochs e;
  for (size_t i = 0; i < e.before.depth.size(); i += 3) e.before.depth[i] *= 5;
  EXPECT_GT(align_coarse(e.before, e.after, e.joint, {}).t1.unexplained_share, 0.1);
}

TEST(AlignCoarse, TheUnitsOfThePassesDoNotMatter) {
  Epochs e;
  const Sim3 expected = align_coarse(e.before, e.after, e.joint, {}).t2_from_t1;
  for (Reconstruction* r : {&e.before, &e.after, &e.joint.reconstruction}) {
    for (float& depth : r->depth) depth *= 1e-9f;
    for (View& view : r->views) view.camera_from_world.translation *= 1e-9;
  }
  const CoarseResult found = align_coarse(e.before, e.after, e.joint, {});
  EXPECT_NEAR(found.t2_from_t1.scale / expected.scale, 1, 1e-6);
  EXPECT_LT((found.t2_from_t1.rotation - expected.rotation).norm(), 1e-6);
  EXPECT_LT((found.t2_from_t1.translation * 1e9 - expected.translation).norm(), 1e-5);
}

TEST(AlignCoarse, IgnoresPixelsBelowTheMedianConfidence) {
  Epochs e;
  // Garbage depth at the low-confidence half of the keyframes' pixels.
  std::vector<float> sorted = e.before.confidence;
  std::nth_element(sorted.begin(), sorted.begin() + sorted.size() / 2, sorted.end());
  for (size_t i = 0; i < e.before.num_pixels(); ++i) {
    if (e.before.confidence[i] < sorted[sorted.size() / 2]) e.before.depth[i] *= 3;
  }
  const CoarseResult result = align_coarse(e.before, e.after, e.joint, {});
  expect_near(result.t2_from_t1, kT2FromScene * kT1FromScene.inverse(), 1e-5);
}

TEST(AlignCoarse, UsesAtMostMPairsAndTheSeedDecidesWhich) {
  Epochs e;
  for (size_t i = 0; i < e.before.depth.size(); ++i) {  // noise, so that the choice shows
    e.before.depth[i] *= 1.0f + 0.01f * static_cast<float>((i * 7919) % 13);
  }
  const CoarseOptions options{.max_correspondences = 200, .seed = 3};
  const EpochToJoint a = align_coarse(e.before, e.after, e.joint, options).t1;
  EXPECT_EQ(a.correspondences, 200);
  EXPECT_GT(a.candidates, 1000);
  const EpochToJoint same = align_coarse(e.before, e.after, e.joint, options).t1;
  EXPECT_EQ(a.joint_from_epoch.translation, same.joint_from_epoch.translation);
  const EpochToJoint other =
      align_coarse(e.before, e.after, e.joint, {.max_correspondences = 200, .seed = 4}).t1;
  EXPECT_NE(a.joint_from_epoch.translation, other.joint_from_epoch.translation);
}

TEST(AlignCoarse, RefusesGeometryThatDeterminesNoSimilarity) {
  Epochs e;
  e.before =
      reconstruct({.frames = 6}, kT1FromScene);  // a plane, of which one row of pixels is left
  const size_t row = 5 * static_cast<size_t>(e.before.width);
  for (size_t i = 0; i < e.before.num_pixels(); ++i) {
    if (i < row || i >= row + static_cast<size_t>(e.before.width)) e.before.depth[i] = 0;
  }
  try {
    align_coarse(e.before, e.after, e.joint, {});
    FAIL() << "accepted points on a line";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kDegenerate);
    EXPECT_NE(std::string(error.what()).find("before"), std::string::npos);
  }
}

TEST(AlignCoarse, RefusesAJointPassOfAnotherSize) {
  Epochs e;
  e.joint.reconstruction.width = 47;
  EXPECT_THROW(align_coarse(e.before, e.after, e.joint, {}), Error);
}

TEST(CoarseOptions, RefuseFewerThanThreeCorrespondences) {
  EXPECT_THROW(CoarseOptions{.max_correspondences = 2}.validate(), Error);
}

}  // namespace
}  // namespace vggtcd
