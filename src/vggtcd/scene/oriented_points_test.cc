// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/scene/oriented_points.h"

#include <gtest/gtest.h>

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <random>

#include "tests/support/toy_scene.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/geometry/robust_extent.h"
#include "vggtcd/scene/confidence.h"
#include "vggtcd/scene/point_cloud.h"

namespace vggtcd {
namespace {

constexpr int kRadius_px = 4, kGrid = 40;

// Steps, steep ramps and holes, and confidences that favour no place: many voxels whose most
// confident pixel has no normal.
Reconstruction rough_scene() {
  const auto relief = [](double x, double y) {
    const double ramp = x - std::floor(x);
    return y > 0.2 ? 0.9 * std::max(0.0, 1 - 6 * ramp) : (ramp > 0.5 ? 0.6 : 0.1);
  };
  Reconstruction scene = testing_support::reconstruct(
      {.frames = 4, .width = 100, .height = 70, .relief = relief}, testing_support::kT2FromT1);
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform;
  for (size_t i = 0; i < scene.num_pixels(); ++i) {
    scene.confidence[i] = 1 + std::floor(20 * uniform(random));  // ties
    const bool among_holes = (i / 25) % 4 == 0;
    if (uniform(random) < (among_holes ? 0.5f : 0.02f)) scene.depth[i] = 0;
  }
  return scene;
}

// The definition, by a QR decomposition of the whole window.
std::optional<Eigen::Vector3d> normal_by_definition(const Reconstruction& r, size_t pixel) {
  const auto width = static_cast<size_t>(r.width);
  const size_t frame = pixel / r.pixels_per_frame();
  const int u = static_cast<int>(pixel % r.pixels_per_frame() % width);
  const int v = static_cast<int>(pixel % r.pixels_per_frame() / width);
  std::vector<Eigen::Vector3d> rows;
  std::vector<double> inverse_depths;
  for (int y = v - kRadius_px; y <= v + kRadius_px; ++y) {
    for (int x = u - kRadius_px; x <= u + kRadius_px; ++x) {
      if (x < 0 || y < 0 || x >= r.width || y >= r.height) return {};
      const double other =
          static_cast<double>(r.depth[frame * r.pixels_per_frame() +
                                      static_cast<size_t>(y) * width + static_cast<size_t>(x)]);
      const double depth = static_cast<double>(r.depth[pixel]);
      if (other <= 0 || std::abs(other - depth) > 0.05 * depth) continue;
      // Rays of the camera: 1 / depth = plane . ray.
      rows.push_back(r.views[frame].pinhole.unproject(x, y, 1.0));
      inverse_depths.push_back(1 / other);
    }
  }
  if (static_cast<double>(rows.size()) < 0.6 * 81) return {};
  Eigen::MatrixXd matrix(rows.size(), 3);
  for (size_t i = 0; i < rows.size(); ++i) matrix.row(static_cast<Eigen::Index>(i)) = rows[i];
  const Eigen::Vector3d plane = matrix.householderQr().solve(Eigen::Map<const Eigen::VectorXd>(
      inverse_depths.data(), static_cast<Eigen::Index>(inverse_depths.size())));
  const Eigen::Vector3d normal = plane.normalized();
  const double cosine = normal.dot(r.views[frame].pinhole.unproject(u, v, 1.0).normalized());
  if (std::abs(cosine) < 0.1) return {};
  return r.views[frame].camera_from_world.rotation.transpose() * (cosine > 0 ? -normal : normal);
}

TEST(OrientedPoints, AreTheMostConfidentPixelsThatHaveANormal) {
  const Reconstruction scene = rough_scene();
  const PointCloud cloud = unproject(scene, confidence_threshold(scene));
  const double size = robust_extent(cloud.positions) / kGrid;
  std::map<std::array<double, 3>, uint32_t> best, best_of_all;
  const auto keep_best = [&](auto& table, const auto& voxel, uint32_t i) {
    const auto [entry, is_new] = table.emplace(voxel, i);
    if (!is_new && cloud.confidence[i] > cloud.confidence[entry->second]) entry->second = i;
  };
  for (uint32_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Array3d number = (cloud.positions[i].cast<double>().array() / size).floor();
    const std::array voxel{number.x(), number.y(), number.z()};
    keep_best(best_of_all, voxel, i);
    if (normal_by_definition(scene, cloud.pixels[i])) keep_best(best, voxel, i);
  }
  std::vector<uint32_t> expected, of_all;
  for (const auto& [voxel, i] : best) expected.push_back(i);
  std::sort(expected.begin(), expected.end());
  // The scene is one in which it matters: many voxels fall back on another pixel or have none.
  size_t other_pixel = 0;
  for (const auto& [voxel, i] : best) other_pixel += best_of_all[voxel] != i ? 1 : 0;
  ASSERT_GT(other_pixel, expected.size() / 10);
  ASSERT_GT(best_of_all.size(), best.size());

  const OrientedPoints points = oriented_points(scene, kGrid, kRadius_px);
  EXPECT_EQ(points.voxel_size_u, size);
  ASSERT_EQ(points.size(), expected.size());
  for (size_t k = 0; k < expected.size(); ++k) {
    const uint32_t pixel = cloud.pixels[expected[k]];
    ASSERT_EQ(points.positions[k], cloud.positions[expected[k]]) << "point " << k;
    EXPECT_EQ(points.frames[k], static_cast<int32_t>(pixel / scene.pixels_per_frame()));
    // Float rounding of the depths, and of the result.
    EXPECT_LT((points.normals[k].cast<double>() - *normal_by_definition(scene, pixel)).norm(), 1e-5)
        << "point " << k;
  }
}

TEST(OrientedPoints, HaveTheSameBitsForAnyNumberOfThreads) {
  const Reconstruction scene = rough_scene();
  set_num_threads(1);
  const OrientedPoints expected = oriented_points(scene, kGrid);
  for (const int threads : {2, 5}) {
    set_num_threads(threads);
    const OrientedPoints points = oriented_points(scene, kGrid);
    EXPECT_EQ(points.positions, expected.positions);
    EXPECT_EQ(points.normals, expected.normals);
    EXPECT_EQ(points.frames, expected.frames);
  }
  set_num_threads(2);
}

}  // namespace
}  // namespace vggtcd
