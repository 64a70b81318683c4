// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/reconstruction/dense_depth.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>

#include "vggtcd/core/parallel.h"

namespace vggtcd {
namespace {

// A wavy, finely textured wall about 5 in front of cameras that stand side by side.
double wall_z(double x, double y) { return 5 + 0.4 * std::sin(1.3 * x) * std::cos(0.9 * y); }

// Periods from 5 px upwards: nothing that pixels 1 / 16 apart could not show.
double texture(double x, double y) {
  double sum = 0;
  for (int k = 1; k <= 6; ++k) {
    sum += std::sin(3.1 * k * x + 1.9 * (7 - k) * y + k * k) +
           std::sin(2.3 * k * y - 2.7 * (7 - k) * x + 2.5 * k * k);
  }
  return 128 + 12 * sum;
}

struct Scene {
  std::vector<GrayView> views;
  std::vector<std::vector<double>> depth;
};

Scene make_scene(int count) {
  Scene scene;
  constexpr int kWidth = 96, kHeight = 64;
  for (int i = 0; i < count; ++i) {
    GrayView view;
    view.pinhole = {80, 80, 47, 31, kWidth, kHeight};
    const Eigen::Vector3d center(0.35 * (i - count / 2), 0.1 * (i % 2), 0);
    view.camera_from_world.rotation =
        Eigen::AngleAxisd(0.05 * (i - count / 2), Eigen::Vector3d::UnitY()).toRotationMatrix();
    view.camera_from_world.translation = -(view.camera_from_world.rotation * center);
    view.valid.assign(kWidth * kHeight, 1);
    std::vector<double> depth;
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        const Eigen::Vector3d ray =
            view.camera_from_world.rotation.transpose() * view.pinhole.unproject(u, v, 1);
        double t = 5;
        for (int step = 0; step < 60; ++step) {  // a contraction: the wall is flatter than the rays
          const Eigen::Vector3d x = center + t * ray;
          t = (wall_z(x.x(), x.y()) - center.z()) / ray.z();
        }
        const Eigen::Vector3d x = center + t * ray;
        view.gray.push_back(static_cast<float>(texture(x.x(), x.y())));
        depth.push_back(t);
      }
    }
    scene.views.push_back(view);
    scene.depth.push_back(depth);
  }
  return scene;
}

InverseDepthRange test_range() { return {1.0 / 3.0, 1.0 / 9.0, 64}; }

DenseDepthOptions test_options() {
  DenseDepthOptions options;
  options.sweep.num_planes = 64;
  return options;
}

std::vector<DepthTask> all_others(size_t count) {
  std::vector<DepthTask> tasks(count);
  for (size_t i = 0; i < count; ++i) {
    for (size_t j = 0; j < count; ++j) {
      if (i != j) tasks[i].sources.push_back(static_cast<int>(j));
    }
    tasks[i].range = test_range();
  }
  return tasks;
}

// The cost by its definition: windows cut out and correlated one by one.
int cost_by_definition(const Scene& scene, size_t reference, size_t source, int u, int v,
                       double inverse_depth) {
  const GrayView& r = scene.views[reference];
  const GrayView& s = scene.views[source];
  const Rigid3 source_from_reference = s.camera_from_world * r.camera_from_world.inverse();
  std::vector<double> a, b;
  for (int dv = -3; dv <= 3; ++dv) {
    for (int du = -3; du <= 3; ++du) {
      const Eigen::Vector3d x = r.pinhole.unproject(u + du, v + dv, 1 / inverse_depth);
      const Eigen::Vector2d p = s.pinhole.project(source_from_reference * x);
      const int pu = static_cast<int>(std::floor(p.x())), pv = static_cast<int>(std::floor(p.y()));
      if (pu < 0 || pv < 0 || pu + 1 >= s.pinhole.width || pv + 1 >= s.pinhole.height)
        return kUnknownCost;
      const auto g = [&](int x0, int y0) {
        return double{1} * s.gray[static_cast<size_t>(y0 * 96 + x0)];
      };
      const double fu = p.x() - pu, fv = p.y() - pv;
      b.push_back((1 - fv) * ((1 - fu) * g(pu, pv) + fu * g(pu + 1, pv)) +
                  fv * ((1 - fu) * g(pu, pv + 1) + fu * g(pu + 1, pv + 1)));
      a.push_back(r.gray[static_cast<size_t>((v + dv) * 96 + u + du)]);
    }
  }
  const auto mean = [](const std::vector<double>& x) {
    double sum = 0;
    for (const double value : x) sum += value;
    return sum / static_cast<double>(x.size());
  };
  const double ma = mean(a), mb = mean(b);
  double aa = 0, bb = 0, ab = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    aa += (a[i] - ma) * (a[i] - ma) / 49;
    bb += (b[i] - mb) * (b[i] - mb) / 49;
    ab += (a[i] - ma) * (b[i] - mb) / 49;
  }
  return static_cast<int>(63.5 * (1 - ab / std::sqrt((aa + 2.25) * (bb + 2.25))) + 0.5);
}

TEST(SweepPlanes, EqualsCorrelationOfWindowsCutOutOneByOne) {
  const Scene scene = make_scene(2);
  DenseDepthOptions options = test_options();
  options.sweep.best_views = 1;
  const auto costs = sweep_planes(scene.views[0], {&scene.views[1]}, test_range(), options.sweep);
  int known = 0;
  for (int v = 5; v < 60; v += 6) {
    for (int u = 5; u < 90; u += 7) {
      for (const int plane : {0, 13, 31, 63}) {
        const int found = costs[static_cast<size_t>((v * 96 + u) * 64 + plane)];
        const int expected =
            cost_by_definition(scene, 0, 1, u, v, test_range().inverse_depth(plane));
        // One unit for rounding; the warp is in float.
        ASSERT_NEAR(found, expected, 1) << u << " " << v << " plane " << plane;
        known += expected != kUnknownCost ? 1 : 0;
      }
    }
  }
  EXPECT_GT(known, 200);
}

TEST(DenseDepth, RecoversAWavyWallWithTheSameBitsForAnyThreads) {
  const Scene scene = make_scene(5);
  const auto tasks = all_others(5);
  std::vector<std::vector<DepthMap>> runs;
  for (const int threads : {1, 4}) {
    set_num_threads(threads);
    ProgressStage stage(silent_progress(), "depth");
    runs.push_back(dense_depth(scene.views, tasks, test_options(), stage));
  }
  set_num_threads(2);
  for (size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(runs[0][i].depth, runs[1][i].depth);
    EXPECT_EQ(runs[0][i].confidence, runs[1][i].confidence);
  }
  // The middle view, away from the border of the windows.
  const double plane_step = (1.0 / 3.0 - 1.0 / 9.0) / 63;
  double sum_off = 0;
  int known = 0, right = 0, all = 0;
  for (int v = 6; v < 58; ++v) {
    for (int u = 6; u < 90; ++u) {
      const auto i = static_cast<size_t>(v * 96 + u);
      const double depth = runs[0][2].depth[i];
      ++all;
      if (!(depth > 0)) continue;
      ++known;
      const double planes_off = (1 / depth - 1 / scene.depth[2][i]) / plane_step;
      // Half a pixel of disparity to the farthest source: correlation over 7 x 7 px windows of a
      // wall that is not parallel to the picture does no better everywhere.
      right += std::abs(planes_off) * plane_step * 80 * 0.7 < 0.5 ? 1 : 0;
      sum_off += planes_off;
    }
  }
  EXPECT_GT(known, all * 8 / 10);
  EXPECT_GT(right, known * 95 / 100);
  // A pixel convention that is off by a half would shift all depths by 2 planes or more.
  EXPECT_LT(std::abs(sum_off / known), 0.1);
}

TEST(AgreedDepth, DropsWhatNoOtherPhotoConfirms) {
  const Scene scene = make_scene(4);
  std::vector<DepthMap> swept;
  for (const auto& truth : scene.depth) {
    swept.push_back(
        {std::vector<float>(truth.begin(), truth.end()), std::vector<float>(truth.size(), 0.5f)});
  }
  const auto patch = static_cast<size_t>(30 * 96 + 48);
  swept[1].depth[patch] *= 0.8f;
  const DepthMap agreed = agreed_depth(1, scene.views, swept, all_others(4), test_options());
  EXPECT_EQ(agreed.depth[patch], 0);
  EXPECT_EQ(agreed.confidence[patch], 0);
  EXPECT_NEAR(agreed.depth[patch + 5], scene.depth[1][patch + 5], 0.01);
  EXPECT_GE(agreed.confidence[patch + 5], 2.5f);
}

TEST(AgreedDepth, ASingleWitnessCountsOnlyWhereBothPhotosAreDistinct) {
  const Scene scene = make_scene(2);
  std::vector<DepthMap> swept;
  for (const auto& truth : scene.depth) {
    swept.push_back(
        {std::vector<float>(truth.begin(), truth.end()), std::vector<float>(truth.size(), 0.5f)});
  }
  // In view 0 itself, and all of what view 1 found in its left half.
  const auto own = static_cast<size_t>(30 * 96 + 80), others = static_cast<size_t>(30 * 96 + 20);
  swept[0].confidence[own] = 0.1f;
  for (size_t i = 0; i < swept[1].confidence.size(); ++i) {
    if (i % 96 < 48) swept[1].confidence[i] = 0.1f;
  }
  const DepthMap agreed = agreed_depth(0, scene.views, swept, all_others(2), test_options());
  EXPECT_EQ(agreed.depth[own], 0);
  EXPECT_EQ(agreed.depth[others], 0);
  EXPECT_NEAR(agreed.depth[own + 3], scene.depth[0][own + 3], 0.01);
}

TEST(RemoveSmallPatches, ForgetsIslandsAndKeepsSlopes) {
  constexpr int kWidth = 12, kHeight = 5;
  DepthMap map{std::vector<float>(kWidth * kHeight), std::vector<float>(kWidth * kHeight, 1.0f)};
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < 6; ++u) {
      map.depth[static_cast<size_t>(v * kWidth + u)] = static_cast<float>(std::pow(1.02, u));
    }
  }
  map.depth[2 * kWidth + 6] = 1.3f;  // touches the slope, but jumps
  map.depth[0 * kWidth + 10] = map.depth[1 * kWidth + 10] = 1.0f;
  const DepthMap before = map;
  remove_small_patches(kWidth, kHeight, 5, map);
  for (int i = 0; i < kWidth * kHeight; ++i) {
    const bool slope = i % kWidth < 6;
    EXPECT_EQ(map.depth[static_cast<size_t>(i)], slope ? before.depth[static_cast<size_t>(i)] : 0)
        << i;
  }
}

TEST(DenseDepth, GivesNoDepthToAViewWithoutSources) {
  const Scene scene = make_scene(3);
  auto tasks = all_others(3);
  tasks[0].sources.clear();
  ProgressStage stage(silent_progress(), "depth");
  const auto maps = dense_depth(scene.views, tasks, test_options(), stage);
  EXPECT_THAT(maps[0].depth, ::testing::Each(0.0f));
}

}  // namespace
}  // namespace vggtcd
