// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/geometry/voxel_components.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

// The definition: flood over all pairs of points.
std::vector<int32_t> naive_components(const std::vector<Eigen::Vector3f>& points, double voxel_size,
                                      int min_points) {
  const auto cell = [&](const Eigen::Vector3f& x) -> Eigen::Vector3i {
    return (x.cast<double>() / voxel_size).array().floor().cast<int>();
  };
  std::vector<bool> dense(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    int count = 0;
    for (const Eigen::Vector3f& x : points) count += cell(x) == cell(points[i]) ? 1 : 0;
    dense[i] = count >= min_points;
  }
  std::vector<int32_t> component(points.size(), -1);
  int32_t next = 0;
  for (size_t seed = 0; seed < points.size(); ++seed) {
    if (!dense[seed] || component[seed] >= 0) continue;
    std::vector<size_t> open{seed};
    component[seed] = next;
    while (!open.empty()) {
      const size_t i = open.back();
      open.pop_back();
      for (size_t k = 0; k < points.size(); ++k) {
        const Eigen::Vector3i step = cell(points[k]) - cell(points[i]);
        if (!dense[k] || component[k] >= 0 || step.cwiseAbs().maxCoeff() > 1) continue;
        component[k] = next;
        open.push_back(k);
      }
    }
    ++next;
  }
  return component;
}

TEST(ConnectedComponents, AreThoseOfTheFloodOverAllPairs) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> place(-4, 4);
  for (const int min_points : {1, 2}) {
    std::vector<Eigen::Vector3f> points;
    for (int i = 0; i < 300; ++i) points.emplace_back(place(random), place(random), place(random));
    const VoxelComponents result = connected_components(points, 0.7, min_points);
    EXPECT_EQ(result.component, naive_components(points, 0.7, min_points));
    EXPECT_GT(result.num_components, 3);
  }
}

TEST(ConnectedComponents, PointsOfOneVoxelShareItsNumber) {
  const std::vector<Eigen::Vector3f> points = {{0.1f, 0, 0}, {-0.1f, 0, 0}, {0.2f, 0.3f, 0.4f}};
  const VoxelComponents result = connected_components(points, 1.0, 1);
  EXPECT_EQ(result.voxel[0], result.voxel[2]);
  EXPECT_NE(result.voxel[0], result.voxel[1]);
  EXPECT_EQ(result.num_voxels, 2u);
  EXPECT_EQ(result.num_components, 1);  // neighbours
}

TEST(ConnectedComponents, OfNothingAreNone) {
  const VoxelComponents result = connected_components({}, 1.0, 1);
  EXPECT_EQ(result.num_components, 0);
  EXPECT_TRUE(result.component.empty());
}

TEST(ConnectedComponents, RefuseAVoxelWithoutSize) {
  EXPECT_THROW(connected_components({}, 0.0, 1), Error);
}

}  // namespace
}  // namespace vggtcd
