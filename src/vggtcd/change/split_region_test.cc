// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/change/split_region.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "vggtcd/geometry/voxel_components.h"

namespace vggtcd {
namespace {

// Two cubes of 4 x 4 x 4 voxels of size 1, ten points in each, joined by a row of four voxels with
// `bridge` points each.
struct Dumbbell {
  std::vector<Eigen::Vector3f> positions;
  RegionPoints region;
  VoxelComponents components;

  explicit Dumbbell(int bridge) {
    for (int x = 0; x < 12; ++x) {
      const bool in_bridge = x >= 4 && x < 8;
      for (int y = 0; y < (in_bridge ? 1 : 4); ++y) {
        for (int z = 0; z < (in_bridge ? 1 : 4); ++z) {
          for (int k = 0; k < (in_bridge ? bridge : 10); ++k) {
            positions.emplace_back(static_cast<float>(x) + 0.05f * static_cast<float>(k + 1),
                                   static_cast<float>(y) + 0.5f, static_cast<float>(z) + 0.5f);
          }
        }
      }
    }
    region.resize(positions.size());
    std::iota(region.begin(), region.end(), 0u);
    components = connected_components(positions, 1.0, 1);
  }
  std::vector<RegionPoints> split(double min_density, size_t least_points = 1) const {
    return split_region(region, positions, components.voxel, 1.0, min_density,
                        [&](const RegionPoints& core) { return core.size() >= least_points; });
  }
};

TEST(SplitRegion, TwoBodiesThatAThinBridgeJoinsAreTwoAndTheBridgeIsSharedOut) {
  const Dumbbell dumbbell(3);
  ASSERT_EQ(dumbbell.components.num_components, 1);
  const std::vector<RegionPoints> parts = dumbbell.split(0.6);
  ASSERT_EQ(parts.size(), 2u);
  EXPECT_EQ(parts[0].size(), 640u + 2 * 3);
  EXPECT_EQ(parts[1].size(), 640u + 2 * 3);
  for (const uint32_t i : parts[0]) EXPECT_LT(dumbbell.positions[i].x(), 6);
  for (const uint32_t i : parts[1]) EXPECT_GE(dumbbell.positions[i].x(), 6);
}

TEST(SplitRegion, EveryPointIsInOnePart) {
  const Dumbbell dumbbell(3);
  RegionPoints all;
  for (const RegionPoints& part : dumbbell.split(0.6)) {
    EXPECT_TRUE(std::ranges::is_sorted(part));
    all.insert(all.end(), part.begin(), part.end());
  }
  std::ranges::sort(all);
  EXPECT_EQ(all, dumbbell.region);
}

TEST(SplitRegion, ABridgeAsDenseAsTheBodiesDividesNothing) {
  EXPECT_EQ(Dumbbell(10).split(0.6).size(), 1u);
  EXPECT_EQ(Dumbbell(3).split(0.2).size(), 1u);
  EXPECT_EQ(Dumbbell(3).split(0).size(), 1u);
}

TEST(SplitRegion, WhatDoesNotStandAloneIsNoPart) {
  const std::vector<RegionPoints> parts = Dumbbell(3).split(0.6, 641);
  ASSERT_EQ(parts.size(), 1u);
  EXPECT_EQ(parts[0], Dumbbell(3).region);
}

TEST(VoxelMeans, CountEveryVoxelOnce) {
  const std::vector<Eigen::Vector3f> positions = {
      {0.1f, 0, 0}, {2.5f, 0, 0}, {0.3f, 0, 0}, {0.8f, 0, 0}};
  const std::vector<uint32_t> voxel = {0, 1, 0, 0};
  const std::vector<Eigen::Vector3f> means = voxel_means({0, 1, 2, 3}, positions, voxel);
  ASSERT_EQ(means.size(), 2u);
  EXPECT_FLOAT_EQ(means[0].x(), 0.4f);
  EXPECT_FLOAT_EQ(means[1].x(), 2.5f);
}

}  // namespace
}  // namespace vggtcd
