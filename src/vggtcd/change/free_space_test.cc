// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/change/free_space.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "tests/support/toy_scene.h"
#include "vggtcd/change/pair_alignment.h"
#include "vggtcd/change/witness.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/scene/point_cloud.h"
#include "vggtcd/scene/sky.h"
#include "vggtcd/scene/view_overlap.h"

namespace vggtcd {
namespace {

using testing_support::box_relief;
using testing_support::flat_relief;
using testing_support::kT2FromT1;
using testing_support::reconstruct;
using testing_support::ToyScene;

constexpr std::vector<float> PhotoAnswers::*kValues[] = {
    &PhotoAnswers::gap, &PhotoAnswers::evidence, &PhotoAnswers::confidence,
    &PhotoAnswers::level_of_detection};

ToyScene scene(double (*relief)(double, double), double offset) {
  return {.frames = 5, .width = 96, .height = 72, .camera_offset = offset, .relief = relief};
}

// All that the votes say, [S, H, W] of either epoch.
struct Answers {
  FreeSpaceChange change;
  PhotoAnswers t1, t2;
};
Answers all_answers(const Reconstruction& before, const Reconstruction& after,
                    const PointVariance& registration = {}) {
  Answers all{{}, PhotoAnswers(before.num_pixels()), PhotoAnswers(after.num_pixels())};
  const auto keep = [](PhotoAnswers& epoch) {
    return [&epoch](int frame, const PhotoAnswers& photo) {
      const auto copy = [&](const auto& from, auto& to) {
        std::ranges::copy(from, to.begin() + frame * std::ssize(from));
      };
      copy(photo.label, epoch.label);
      for (const auto values : kValues) copy(photo.*values, epoch.*values);
    };
  };
  all.change = free_space_changes(before, after, kT2FromT1, {}, registration, silent_progress(),
                                  nullptr, {keep(all.t1), keep(all.t2)});
  return all;
}

// Where the pixel's point lies in the toy scene, for reconstructions in T2's frame.
Eigen::Vector3d in_scene(const Reconstruction& r, size_t pixel) {
  return kT2FromT1.inverse() * unproject_pixel(r, static_cast<uint32_t>(pixel)).cast<double>();
}

TEST(FreeSpaceChanges, ABoxThatAppearedIsAddedAndTheRestUnchanged) {
  const Reconstruction before = reconstruct(scene(flat_relief, 0), Sim3{});
  const Reconstruction after = reconstruct(scene(box_relief, 0.1), kT2FromT1);
  const FreeSpaceChange change = free_space_changes(before, after, kT2FromT1, {});
  int box = 0, box_added = 0, plane = 0, plane_added = 0;
  for (size_t i = 0; i < after.num_pixels(); ++i) {
    const ChangeLabel label = change.t2.label[i];
    if (label == ChangeLabel::kNoEvidence || label == ChangeLabel::kUnobserved) continue;
    const double height = 5.0 - in_scene(after, i).z();
    if (height > 0.45) {
      ++box;
      box_added += label == ChangeLabel::kAdded ? 1 : 0;
    } else if (height < 0.01) {
      ++plane;
      plane_added += label == ChangeLabel::kAdded ? 1 : 0;
    }
    EXPECT_NE(label, ChangeLabel::kRemoved);
  }
  ASSERT_GT(box, 500);
  EXPECT_GT(box_added, 0.97 * box);
  EXPECT_LT(plane_added, 0.01 * plane);
}

// Nothing is left of the plane to the right of x = -0.5: the photos show what `sky` says.
void open_to_the_right(Reconstruction& r, const Sim3& frame_from_scene, uint8_t sky) {
  r.sky.assign(r.num_pixels(), kNoSky);
  for (size_t i = 0; i < r.num_pixels(); ++i) {
    const Eigen::Vector3d x =
        frame_from_scene.inverse() * unproject_pixel(r, static_cast<uint32_t>(i)).cast<double>();
    if (x.x() < -0.5 || x.z() < 4.99) continue;  // the plane to the left, or the box
    r.sky[i] = sky;
    r.depth[i] = 0;
  }
}

TEST(FreeSpaceChanges, TheSkySeenThroughABoxTestifiesThatItIsGone) {
  Reconstruction before = reconstruct(scene(box_relief, 0), Sim3{});
  open_to_the_right(before, {}, kOpenSky);
  for (const uint8_t sky : {kOpenSky, kSky}) {
    Reconstruction after = reconstruct(scene(flat_relief, 0.1), kT2FromT1);
    open_to_the_right(after, kT2FromT1, sky);
    const Answers change = all_answers(before, after);
    int box = 0, removed = 0, left = 0, left_removed = 0;
    for (size_t i = 0; i < before.num_pixels(); ++i) {
      const ChangeLabel label = change.t1.label[i];
      if (before.depth[i] == 0) {
        EXPECT_EQ(label, ChangeLabel::kNoEvidence);
        continue;
      }
      const bool on_box = unproject_pixel(before, static_cast<uint32_t>(i)).z() < 4.99f;
      const bool is_removed = label == ChangeLabel::kRemoved;
      (on_box ? box : left) += 1;
      (on_box ? removed : left_removed) += is_removed ? 1 : 0;
      if (is_removed) {
        EXPECT_NEAR(change.t1.gap[i], change.change.scene_extent_u,
                    0.5 * change.change.scene_extent_u);
      }
    }
    ASSERT_GT(box, 300);
    ASSERT_GT(left, 500);
    EXPECT_EQ(left_removed, 0);
    // A sky that may be a white ceiling says nothing.
    if (sky == kOpenSky) {
      EXPECT_GT(removed, 0.9 * box);
    } else {
      EXPECT_EQ(removed, 0);
    }
  }
}

TEST(MakeWitness, TheSkyTestifiesAwayFromItsBorderOnly) {
  Reconstruction r = reconstruct(scene(flat_relief, 0), Sim3{});
  r.sky.assign(r.num_pixels(), kNoSky);
  for (size_t i = 0; i < r.pixels_per_frame(); ++i) {
    if (i % 96 < 48) r.sky[i] = kOpenSky, r.depth[i] = 0;
  }
  const Witness witness = make_witness(r, {}, 0, 1);
  const DepthWindows photo = witness.windows(0);
  EXPECT_TRUE(photo.open(0, 0));
  EXPECT_TRUE(photo.open(45, 30));  // two pixels of 96 / 40 are left as a margin
  EXPECT_FALSE(photo.open(46, 30));
  EXPECT_FALSE(photo.open(60, 30));
  EXPECT_FALSE(witness.windows(1).open(0, 0));
  float near = 0, far = 0;
  EXPECT_FALSE(photo.read(10, 10, near, far));  // the sky has no depth
  EXPECT_TRUE(photo.read(60, 30, near, far));
}

TEST(FreeSpaceChanges, WhatTheBoxHidesIsNotCalledRemoved) {
  const Reconstruction before = reconstruct(scene(flat_relief, 0), Sim3{});
  const Reconstruction after = reconstruct(scene(box_relief, 0.1), kT2FromT1);
  const FreeSpaceChange change = free_space_changes(before, after, kT2FromT1, {});
  int removed = 0, judged = 0;
  for (const ChangeLabel label : change.t1.label) {
    removed += label == ChangeLabel::kRemoved ? 1 : 0;
    judged += label == ChangeLabel::kUnchanged ? 1 : 0;
  }
  EXPECT_GT(judged, 1000);
  EXPECT_LT(removed, 0.01 * judged);  // the plane behind the box is still there
}

TEST(FreeSpaceChanges, ABoxThatVanishedIsRemoved) {
  const Reconstruction before = reconstruct(scene(box_relief, 0), Sim3{});
  const Reconstruction after = reconstruct(scene(flat_relief, 0.1), kT2FromT1);
  const Answers change = all_answers(before, after);
  int removed_on_box = 0, removed_elsewhere = 0;
  for (size_t i = 0; i < before.num_pixels(); ++i) {
    if (change.t1.label[i] != ChangeLabel::kRemoved) continue;
    const bool on_box = 5.0 - unproject_pixel(before, static_cast<uint32_t>(i)).z() > 0.05f;
    (on_box ? removed_on_box : removed_elsewhere) += 1;
    EXPECT_GT(change.t1.gap[i], 0);
  }
  EXPECT_GT(removed_on_box, 500);
  EXPECT_LT(removed_elsewhere, 0.03 * removed_on_box);
}

TEST(FreeSpaceChanges, WhatTheOtherEpochNeverSawIsUnobserved) {
  const Reconstruction before = reconstruct(scene(flat_relief, 0), Sim3{});
  const Reconstruction after =
      reconstruct(scene(flat_relief, 50.0), Sim3{});  // a walk somewhere else
  const FreeSpaceChange change = free_space_changes(before, after, Sim3{}, {});
  for (const ChangeLabel label : change.t1.label) {
    EXPECT_TRUE(label == ChangeLabel::kUnobserved || label == ChangeLabel::kNoEvidence);
  }
}

TEST(FreeSpaceChanges, AnUnchangedSceneHasNoChanges) {
  const Reconstruction before = reconstruct(scene(box_relief, 0), Sim3{});
  const Reconstruction after = reconstruct(scene(box_relief, 0.1), kT2FromT1);
  const FreeSpaceChange change = free_space_changes(before, after, kT2FromT1, {});
  int changed = 0;
  for (const auto* labels : {&change.t1.label, &change.t2.label}) {
    for (const ChangeLabel label : *labels) {
      changed += label == ChangeLabel::kRemoved || label == ChangeLabel::kAdded ? 1 : 0;
    }
  }
  EXPECT_LT(changed, 0.005 * static_cast<double>(before.num_pixels() + after.num_pixels()));
}

TEST(FreeSpaceChanges, SameLabelsAndGapsForAnyNumberOfThreads) {
  const Reconstruction before = reconstruct(scene(flat_relief, 0), Sim3{});
  const Reconstruction after = reconstruct(scene(box_relief, 0.1), kT2FromT1);
  set_num_threads(1);
  const Answers one = all_answers(before, after);
  set_num_threads(5);
  const Answers five = all_answers(before, after);
  set_num_threads(2);
  EXPECT_EQ(one.t2.label, five.t2.label);
  EXPECT_EQ(one.change.t2.changed_confidence, five.change.t2.changed_confidence);
  for (const auto values : kValues) {
    for (size_t i = 0; i < one.t2.gap.size(); ++i) {
      const float a = (one.t2.*values)[i], b = (five.t2.*values)[i];
      EXPECT_TRUE(a == b || (std::isnan(a) && std::isnan(b)));
    }
  }
}

TEST(FreeSpaceChanges, WhatIsKeptIsWhatThePhotosWereTold) {
  const Reconstruction before = reconstruct(scene(flat_relief, 0), Sim3{});
  const Reconstruction after = reconstruct(scene(box_relief, 0.1), kT2FromT1);
  const Answers all = all_answers(before, after);
  EXPECT_EQ(all.change.t1.label, all.t1.label);
  EXPECT_EQ(all.change.t2.label, all.t2.label);
  std::vector<float> of_changed;
  for (size_t i = 0; i < all.t2.label.size(); ++i) {
    if (is_change(all.t2.label[i])) of_changed.push_back(all.t2.confidence[i]);
  }
  ASSERT_GT(of_changed.size(), 500u);
  EXPECT_EQ(all.change.t2.changed_confidence, of_changed);
}

TEST(FreeSpaceChanges, TheLevelOfDetectionIsNeverBelowWhatTheRegistrationAllows) {
  const Reconstruction before = reconstruct(scene(flat_relief, 0), Sim3{});
  const Reconstruction after = reconstruct(scene(box_relief, 0.1), kT2FromT1);
  Eigen::Matrix<double, 7, 7> covariance = Eigen::Matrix<double, 7, 7>::Zero();
  covariance.block<3, 3>(3, 3) = 0.01 * 0.01 * Eigen::Matrix3d::Identity();
  const Answers change = all_answers(before, after, {covariance, Eigen::Vector3d::Zero()});
  int judged = 0;
  for (size_t i = 0; i < after.num_pixels(); ++i) {
    if (change.t2.label[i] == ChangeLabel::kUnobserved ||
        change.t2.label[i] == ChangeLabel::kNoEvidence) {
      continue;
    }
    ++judged;
    EXPECT_GE(change.t2.level_of_detection[i], 1.96f * 0.01f * 0.999f);
    EXPECT_GE(change.t2.confidence[i], 0);
    EXPECT_LE(change.t2.confidence[i], 1);
  }
  EXPECT_GT(judged, 1000);
}

// Windows of the pixel itself.
class SinglePixels {
 public:
  explicit SinglePixels(const Reconstruction& r)
      : reconstruction_(r), center_(r.pixels_per_frame(), 4 | 4 << 4), steps_(r.width) {}
  DepthWindows of(int frame) const {
    return {reconstruction_.frame_depth(frame).data(), center_.data(), &steps_, 1,
            reconstruction_.width};
  }

 private:
  const Reconstruction& reconstruction_;
  std::vector<uint8_t> center_;
  WindowSteps steps_;
};

TEST(Witness, KeepsTheNearestAndTheFarthestDepthAroundEachPixel) {
  Reconstruction r = reconstruct(scene(box_relief, 0), Sim3{});
  for (size_t i = 0; i < r.num_pixels(); i += 7) r.depth[i] = 0;
  for (size_t i = 3; i < r.num_pixels(); i += 11) r.confidence[i] = -1;  // may not testify
  for (int y = 20; y < 25; ++y) {
    for (int x = 30; x < 36; ++x) r.depth[static_cast<size_t>(y * r.width + x)] = 0;
  }
  const Witness witness = make_witness(r, kT2FromT1, 0, 1);
  int without = 0;
  for (int v = 0; v < r.height; ++v) {
    for (int u = 0; u < r.width; ++u) {
      std::vector<float> window;
      for (int y = v - 1; y <= v + 1; ++y) {
        for (int x = u - 1; x <= u + 1; ++x) {
          const size_t i = static_cast<size_t>(y * r.width + x);
          if (x < 0 || y < 0 || x >= r.width || y >= r.height || !testifies(r, i, 0)) continue;
          window.push_back(static_cast<float>(kT2FromT1.scale) * r.depth[i]);
        }
      }
      float near = 0, far = 0;
      const bool found = witness.windows(0).read(u, v, near, far);
      ASSERT_EQ(found, !window.empty()) << u << " " << v;
      without += found ? 0 : 1;
      if (!found) continue;
      EXPECT_EQ(near, std::ranges::min(window));
      EXPECT_EQ(far, std::ranges::max(window));
    }
  }
  EXPECT_GT(without, 5);
}

// Two photos of one wavy surface whose poses disagree: the pair is brought together again.
TEST(AlignPair, RemovesASmallRotationAndScale) {
  const auto waves = [](double x, double y) { return 0.2 * std::sin(2 * x) * std::cos(1.5 * y); };
  const ToyScene toy{.frames = 2, .width = 96, .height = 72, .relief = waves};
  const Reconstruction truth = reconstruct(toy, Sim3{});
  const Sim3 wrong{
      1.01, Eigen::AngleAxisd(0.006, Eigen::Vector3d::UnitY()).toRotationMatrix(), {0.01, 0, 0}};
  std::vector<Eigen::Vector3f> points;
  for (uint32_t pixel = 0; pixel < truth.pixels_per_frame(); pixel += 3) {
    points.push_back((wrong * unproject_pixel(truth, pixel).cast<double>()).cast<float>());
  }
  const SinglePixels windows(truth);
  const WitnessPhoto photo{truth.views[1].camera_from_world, truth.views[1].pinhole, windows.of(1)};
  const PairAlignment before = align_pair(points, photo, 0.1, 5, {.iterations = 0});
  const PairAlignment after = align_pair(points, photo, 0.1, 5, {.iterations = 6});
  EXPECT_GT(before.gap_sigma, 0.008);
  EXPECT_LT(after.gap_sigma, 0.15 * before.gap_sigma);
}

TEST(AlignPair, WithoutCommonSurfaceCorrectsNothing) {
  const Reconstruction r = reconstruct(scene(flat_relief, 0), Sim3{});
  const std::vector<Eigen::Vector3f> behind(100, Eigen::Vector3f(0, 0, -3));
  const SinglePixels windows(r);
  const WitnessPhoto photo{r.views[0].camera_from_world, r.views[0].pinhole, windows.of(0)};
  const PairAlignment pair = align_pair(behind, photo, 0.1, 5, {});
  EXPECT_EQ(pair.samples, 0);
  EXPECT_EQ(pair.matrix, r.views[0].camera_from_world.rotation);
}

TEST(OverlappingViews, RanksTheViewFromTheSamePlaceFirst) {
  const Reconstruction walk = reconstruct(scene(flat_relief, 0), Sim3{});
  const auto views = overlapping_views(walk, walk, Sim3{}, 2);
  for (size_t i = 0; i < views.size(); ++i) {
    ASSERT_EQ(views[i].size(), 2u);
    EXPECT_EQ(views[i][0], static_cast<int>(i));
  }
}

TEST(FreeSpaceOptions, RefuseNoViews) {
  EXPECT_THROW(FreeSpaceOptions{.max_views = 0}.validate(), Error);
}

}  // namespace
}  // namespace vggtcd
