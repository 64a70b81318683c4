// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/change/nearest_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/toy_scene.h"
#include "vggtcd/scene/confidence.h"
#include "vggtcd/scene/point_cloud.h"

namespace vggtcd {
namespace {

using testing_support::box_relief;
using testing_support::flat_relief;
using testing_support::kT2FromT1;
using testing_support::reconstruct;
using testing_support::ToyScene;

TEST(DetectChanges, FindsABoxThatAppearedAndNothingElse) {
  const Reconstruction before = reconstruct({.frames = 4, .relief = flat_relief}, Sim3{});
  const ToyScene after_scene{.frames = 4, .camera_offset = 0.1, .relief = box_relief};
  const Reconstruction after = reconstruct(after_scene, kT2FromT1);
  const ChangeSet changes =
      detect_changes(before, after, kT2FromT1, {.threshold_fraction = 0.04, .bound_fraction = 0.1});
  ASSERT_GT(changes.t2.changed, 0);
  for (size_t i = 0; i < after.num_pixels(); ++i) {
    if (std::isnan(changes.t2.score[i])) {
      continue;
    }
    const Eigen::Vector3d x =
        kT2FromT1.inverse() * unproject_pixel(after, static_cast<uint32_t>(i)).cast<double>();
    // Above the plane by clearly more or clearly less than tau (in T1 units).
    const double tau = changes.threshold_u / kT2FromT1.scale;
    if (5.0 - x.z() > 1.5 * tau) {
      EXPECT_TRUE(changes.changed(changes.t2.score[i])) << x.transpose();
    }
    if (5.0 - x.z() < 0.1 * tau) {
      EXPECT_FALSE(changes.changed(changes.t2.score[i])) << x.transpose();
    }
  }
}

TEST(DetectChanges, ScoresAreTheDistancesOfBruteForceCutAtTheBound) {
  const Reconstruction before =
      reconstruct({.frames = 2, .width = 24, .height = 18, .relief = flat_relief}, Sim3{});
  const Reconstruction after = reconstruct(
      {.frames = 2, .width = 24, .height = 18, .camera_offset = 0.3, .relief = box_relief},
      kT2FromT1);
  const ChangeSet changes = detect_changes(before, after, kT2FromT1,
                                           {.threshold_fraction = 0.02, .bound_fraction = 0.05});
  const PointCloud t1 = unproject(before, confidence_threshold(before), kT2FromT1);
  const PointCloud t2 = unproject(after, confidence_threshold(after));
  ASSERT_EQ(changes.t1.points, static_cast<int64_t>(t1.size()));
  int64_t changed = 0;
  for (size_t i = 0; i < t1.size(); ++i) {
    float nearest = static_cast<float>(changes.bound_u);
    for (const auto& x : t2.positions) nearest = std::min(nearest, (x - t1.positions[i]).norm());
    EXPECT_NEAR(changes.t1.score[t1.pixels[i]], nearest, 1e-5);
    changed += nearest > static_cast<float>(changes.threshold_u) ? 1 : 0;
  }
  EXPECT_EQ(changes.t1.changed, changed);
}

TEST(DetectChanges, PixelsWithoutEvidenceHaveNoScore) {
  Reconstruction before = reconstruct({.frames = 2, .relief = flat_relief}, Sim3{});
  const Reconstruction after = reconstruct({.frames = 2, .relief = flat_relief}, Sim3{});
  before.depth[1000] = 0;
  const ChangeSet changes = detect_changes(before, after, Sim3{}, {});
  EXPECT_TRUE(std::isnan(changes.t1.score[1000]));
  const auto nan_count = std::count_if(changes.t1.score.begin(), changes.t1.score.end(),
                                       [](float score) { return std::isnan(score); });
  EXPECT_EQ(nan_count + changes.t1.points, static_cast<int64_t>(before.num_pixels()));
  EXPECT_EQ(changes.t1.changed, 0);
}

TEST(DetectChanges, RefusesAnEpochWithoutDepth) {
  Reconstruction before = reconstruct({.frames = 2}, Sim3{});
  const Reconstruction after = before;
  std::fill(before.depth.begin(), before.depth.end(), 0.0f);
  EXPECT_THROW(detect_changes(before, after, Sim3{}, {}), Error);
}

TEST(ChangeOptions, RefuseABoundBelowTheThreshold) {
  const ChangeOptions options{.threshold_fraction = 0.03, .bound_fraction = 0.02};
  EXPECT_THROW(options.validate(), Error);
}

}  // namespace
}  // namespace vggtcd
