// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/registration/fine.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>

#include "tests/support/toy_scene.h"
#include "vggtcd/scene/confidence.h"

namespace vggtcd {
namespace {

// A bumpy patch of n x n points with spacing 0.05.
DownsampledCloud patch(int n) {
  DownsampledCloud cloud;
  cloud.voxel_size_u = 0.05;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const double x = 0.05 * i, y = 0.05 * j;
      cloud.positions.emplace_back(static_cast<float>(x), static_cast<float>(y),
                                   static_cast<float>(0.5 * std::sin(3 * x) * std::cos(2 * y)));
    }
  }
  return cloud;
}

TEST(StaticSet, TakesWhatIsCloserThanTheFactorTimesTheMedian) {
  const std::vector<float> distances = {1, 2, 3, 5.9f, 6, 100, 0};  // median 3
  EXPECT_THAT(static_set(distances, 2.0), testing::ElementsAre(0u, 1u, 2u, 3u, 6u));
  EXPECT_TRUE(static_set({}, 3.0).empty());
}

TEST(RefinedTranslation, IsTheMeanOffsetOfTheStaticPairs) {
  const Sim3 t2_from_t1{
      2.0, Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitZ()).toRotationMatrix(), {9, 9, 9}};
  const std::vector<Eigen::Vector3f> t1 = {{1, 0, 0}, {0, 1, 0}, {5, 5, 5}};
  std::vector<Eigen::Vector3f> t2;
  for (const auto& x : t1) {
    t2.push_back(
        (2.0 * (t2_from_t1.rotation * x.cast<double>()) + Eigen::Vector3d(1, 2, 3)).cast<float>());
  }
  t2[2] = {100, 100, 100};
  const std::vector<int32_t> nearest = {0, 1, 2};
  const std::vector<uint32_t> members = {0, 1};
  EXPECT_LT(
      (refined_translation(t1, t2, nearest, members, t2_from_t1) - Eigen::Vector3d(1, 2, 3)).norm(),
      1e-6);
}

TEST(RefineTranslation, RemovesASmallOffsetAndLocksScaleAndRotation) {
  const DownsampledCloud cloud = patch(40);
  Sim3 coarse;
  coarse.translation = {0.01, -0.008, 0.015};
  const FineResult result = refine_translation(cloud, cloud, coarse, {});
  EXPECT_EQ(result.verdict, FineVerdict::kRefined);
  EXPECT_LT(result.t2_from_t1.translation.norm(), 1e-6);  // the nearest of each point is its twin
  EXPECT_EQ(result.t2_from_t1.scale, coarse.scale);
  EXPECT_EQ(result.t2_from_t1.rotation, coarse.rotation);
  EXPECT_LT(*result.median_residual_fine_u, result.median_residual_coarse_u);
  EXPECT_THAT(result.explanation, testing::HasSubstr("Refined"));
}

TEST(RefineTranslation, IsNotDrawnByAChangedRegion) {
  const DownsampledCloud t2 = patch(40);
  DownsampledCloud t1 = t2;
  for (auto& x : t1.positions) {
    if (x.x() < 0.5f) x.z() += 3.0f;  // a quarter of the patch has moved far away
  }
  Sim3 coarse;
  coarse.translation = {0.01, -0.008, 0.015};
  const FineResult result = refine_translation(t1, t2, coarse, {});
  EXPECT_EQ(result.verdict, FineVerdict::kRefined);
  EXPECT_LT(result.t2_from_t1.translation.norm(), 1e-5);
}

TEST(RefineTranslation, KeepsCoarseWhenTheMedianResidualDoesNotFall) {
  // Two out of three points fit perfectly, the rest pulls the mean: the median can only grow.
  const DownsampledCloud t2 = patch(30);
  DownsampledCloud t1 = t2;
  for (size_t i = 0; i < t1.positions.size(); i += 3) t1.positions[i].z() += 0.01f;
  FineOptions options;
  options.static_factor = 1e9;
  // median(d) is 0, so no point is closer than any multiple of it: nothing static.
  EXPECT_EQ(refine_translation(t1, t2, {}, options).verdict, FineVerdict::kKeptCoarseFewStatic);
  // With every residual positive the static set is everything, and the self-check decides.
  for (size_t i = 0; i < t1.positions.size(); ++i)
    t1.positions[i].z() += i % 3 == 0 ? 0.02f : 1e-4f;
  const FineResult result = refine_translation(t1, t2, {}, options);
  EXPECT_EQ(result.verdict, FineVerdict::kKeptCoarseResidual);
  EXPECT_EQ(result.t2_from_t1.translation, Eigen::Vector3d::Zero());
  EXPECT_GE(*result.median_residual_fine_u, result.median_residual_coarse_u);
  EXPECT_GT(result.translation_update_u.norm(), 0);
}

TEST(RefineTranslation, KeepsCoarseWithFewerThanAHundredStaticPoints) {
  Sim3 coarse;
  coarse.translation = {0.01, 0, 0};
  const FineResult few = refine_translation(patch(9), patch(9), coarse, {});
  EXPECT_EQ(few.verdict, FineVerdict::kKeptCoarseFewStatic);
  EXPECT_EQ(few.t2_from_t1.translation, coarse.translation);
  EXPECT_FALSE(few.median_residual_fine_u.has_value());
  EXPECT_THAT(few.explanation, testing::HasSubstr("81"));
  EXPECT_EQ(refine_translation(patch(10), patch(10), coarse, {}).verdict, FineVerdict::kRefined);
}

TEST(DownsampleConfident, KeepsOneConfidentPointPerVoxel) {
  const Reconstruction r = testing_support::reconstruct({.frames = 3}, Sim3{});
  const DownsampledCloud cloud = downsample_confident(r, 20);
  ASSERT_GT(cloud.positions.size(), 20u);
  const PointCloud confident = unproject(r, confidence_threshold(r));
  std::set<std::array<float, 3>> candidates;
  for (const auto& x : confident.positions) candidates.insert({x.x(), x.y(), x.z()});
  for (const auto& x : cloud.positions) {
    EXPECT_TRUE(candidates.contains({x.x(), x.y(), x.z()}));
  }
  EXPECT_LT(cloud.positions.size(), confident.size() / 3);
}

TEST(AlignFine, RecoversATranslationErrorOfTheCoarseStage) {
  const auto relief = [](double x, double y) {
    return 0.3 + 0.3 * std::sin(2 * x) * std::cos(3 * y);
  };
  const Reconstruction before =
      testing_support::reconstruct({.frames = 5, .relief = relief}, Sim3{});
  const Reconstruction after =
      testing_support::reconstruct({.frames = 5, .camera_offset = 0.13, .relief = relief}, Sim3{});
  Sim3 coarse;
  coarse.translation = {0.02, 0.01, 0.05};
  const FineResult result = align_fine(before, after, coarse, {});
  EXPECT_EQ(result.verdict, FineVerdict::kRefined);
  EXPECT_LT(result.t2_from_t1.translation.norm(), 0.5 * coarse.translation.norm());
}

TEST(FineOptions, NameTheFieldTheyRefuse) {
  try {
    FineOptions{.static_factor = -1}.validate();
    FAIL();
  } catch (const Error& error) {
    EXPECT_THAT(error.what(),
                testing::AllOf(testing::HasSubstr("static_factor"), testing::HasSubstr("-1")));
  }
}

}  // namespace
}  // namespace vggtcd
