// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/geometry/voxel_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"

namespace vggtcd {
namespace {

using Points = std::vector<Eigen::Vector3f>;

// The definition, with an ordered map.
std::vector<uint32_t> by_definition(const Points& positions, const std::vector<float>& confidence,
                                    double size) {
  std::map<std::array<double, 3>, uint32_t> best;
  for (uint32_t i = 0; i < positions.size(); ++i) {
    const Eigen::Array3d voxel = (positions[i].cast<double>().array() / size).floor();
    const auto [entry, is_new] = best.emplace(std::array{voxel.x(), voxel.y(), voxel.z()}, i);
    if (!is_new && confidence[i] > confidence[entry->second]) entry->second = i;
  }
  std::vector<uint32_t> kept;
  for (const auto& [voxel, index] : best) kept.push_back(index);
  std::sort(kept.begin(), kept.end());
  return kept;
}

class VoxelGrid : public ::testing::TestWithParam<int> {
 protected:
  void SetUp() override { set_num_threads(GetParam()); }
  void TearDown() override { set_num_threads(2); }
};

TEST_P(VoxelGrid, MatchesItsDefinitionAtEverySize) {
  // A walk, so that neighbours often share a voxel, across the origin; few confidences: many ties.
  std::mt19937 random(1);
  std::normal_distribution<float> normal(0, 0.01f);
  std::uniform_int_distribution<int> level(-2, 2);
  Points positions;
  std::vector<float> confidence;
  Eigen::Vector3f x(0, 0, 0);
  for (int i = 0; i < 200'000; ++i) {
    x += Eigen::Vector3f(normal(random), normal(random), normal(random)) - 0.002f * x;
    positions.push_back(x);
    confidence.push_back(static_cast<float>(level(random)));
  }
  for (const double size : {0.003, 0.1, 0.25, 1.0, 1000.0}) {
    EXPECT_EQ(voxel_downsample(positions, confidence, size),
              by_definition(positions, confidence, size))
        << "voxel size " << size;
  }
}

TEST_P(VoxelGrid, PointsInTheVoxelsOfMembersMatchTheirDefinition) {
  std::mt19937 random(2);
  std::normal_distribution<float> normal;
  Points positions(150'000);
  for (auto& x : positions) x = {normal(random), normal(random), 0.1f * normal(random)};
  std::vector<uint32_t> members;
  for (int i = 0; i < 300; ++i) members.push_back(static_cast<uint32_t>(random() % 150'000));
  for (const double size : {0.01, 0.2, 100.0}) {
    const auto voxel = [&](uint32_t i) {
      const Eigen::Array3d number = (positions[i].cast<double>().array() / size).floor();
      return std::array{number.x(), number.y(), number.z()};
    };
    std::map<std::array<double, 3>, bool> marked;
    for (const uint32_t i : members) marked[voxel(i)] = true;
    std::vector<uint32_t> expected;
    for (uint32_t i = 0; i < positions.size(); ++i) {
      if (marked.contains(voxel(i))) expected.push_back(i);
    }
    EXPECT_EQ(points_in_voxels_of(positions, members, size), expected) << "voxel size " << size;
  }
  EXPECT_TRUE(points_in_voxels_of(positions, {}, 1).empty());
}

INSTANTIATE_TEST_SUITE_P(Threads, VoxelGrid, ::testing::Values(1, 2, 5));

TEST(VoxelDownsample, KeepsTheMostConfidentAndOfEqualsTheFirst) {
  const Points positions{{0.1f, 0, 0}, {0.2f, 0, 0}, {0.3f, 0, 0}, {-0.1f, 0, 0}, {-0.2f, 0, 0}};
  EXPECT_EQ(voxel_downsample(positions, std::vector<float>{1, 3, 3, 2, 2}, 1),
            (std::vector<uint32_t>{1, 3}));
  EXPECT_EQ(voxel_downsample(positions, std::vector<float>{-0.0f, 0.0f, -1, -5, -4}, 1),
            (std::vector<uint32_t>{0, 4}));
}

TEST(VoxelDownsample, OfNoPointsIsEmpty) { EXPECT_TRUE(voxel_downsample({}, {}, 1).empty()); }

TEST(VoxelDownsample, RefusesAGridTooFineToCount) {
  const Points positions{{1, 2, 3}, {1e6f, 0, 0}};
  const std::vector<float> confidence{1, 1};
  EXPECT_EQ(voxel_downsample(positions, confidence, 1e-3).size(), 2u);
  try {
    voxel_downsample(positions, confidence, 1e-4);
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kDegenerate);
  }
}

TEST(VoxelDownsample, RefusesNonsense) {
  const Points positions{{1, 2, 3}};
  EXPECT_THROW(voxel_downsample(positions, std::vector<float>{}, 1), Error);
  EXPECT_THROW(voxel_downsample(positions, std::vector<float>{1}, 0), Error);
  EXPECT_THROW(voxel_downsample(positions, std::vector<float>{1}, NAN), Error);
  EXPECT_THROW(voxel_downsample(Points{{NAN, 0, 0}}, std::vector<float>{1}, 1), Error);
}

}  // namespace
}  // namespace vggtcd
