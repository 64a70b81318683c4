// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/geometry/nearest_neighbors.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <tuple>

#include "vggtcd/core/cpu_features.h"
#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"

namespace vggtcd {
namespace {

using Points = std::vector<Eigen::Vector3f>;
constexpr float kNoBound = NearestNeighborIndex::kNoBound;

// The definition in the header, word for word.
NearestNeighbors brute_force(const Points& targets, const Points& queries, float bound) {
  NearestNeighbors result;
  for (const Eigen::Vector3f& q : queries) {
    float best = kNoBound;
    int32_t best_index = -1;
    for (size_t i = 0; i < targets.size(); ++i) {
      const float dx = targets[i].x() - q.x(), dy = targets[i].y() - q.y(),
                  dz = targets[i].z() - q.z();
      const float distance_squared = (dx * dx + dy * dy) + dz * dz;
      if (distance_squared < best && std::sqrt(distance_squared) <= bound) {
        best = distance_squared;
        best_index = static_cast<int32_t>(i);
      }
    }
    result.distance.push_back(best_index < 0 ? bound : std::sqrt(best));
    result.index.push_back(best_index);
  }
  return result;
}

// Points in a cube of side 2 * extent.
Points random_points(size_t count, unsigned seed, float extent = 1) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(-extent, extent);
  Points points(count);
  for (auto& x : points) x = {uniform(random), uniform(random), uniform(random)};
  return points;
}

// A wavy surface seen by several noisy depth maps, denser near the middle, with a few stray points:
// what the clouds of reconstructions look like.
Points surface_points(size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  Points points(count);
  for (size_t i = 0; i < count; ++i) {
    const float u = normal(random), v = normal(random);
    points[i] = {u, v, 0.3f * std::sin(3 * u) + 0.01f * normal(random)};
    if (i % 100 == 0) points[i] *= 5 * std::abs(normal(random));
  }
  return points;
}

// Every combination of threads and instruction set.
class NearestNeighborsEverywhere : public ::testing::TestWithParam<std::tuple<int, CpuLevel>> {
 protected:
  void SetUp() override {
    const auto [threads, level] = GetParam();
    if (level > detected_cpu_level()) {
      GTEST_SKIP() << "this processor has no " << enum_to_string(level);
    }
    set_num_threads(threads);
    level_.emplace(level);
  }
  void TearDown() override { set_num_threads(2); }

  // Against brute force, through every way to ask.
  static void expect_exact(const Points& targets, const Points& queries, float bound) {
    const NearestNeighbors expected = brute_force(targets, queries, bound);
    const NearestNeighborIndex index(targets);
    const NearestNeighbors found = index.query(queries, bound);
    EXPECT_EQ(found.distance, expected.distance);
    EXPECT_EQ(found.index, expected.index);

    std::vector<float> distance(queries.size(), -1);
    index.query(queries, bound, distance);
    EXPECT_EQ(distance, expected.distance) << "without indices";

    std::vector<int32_t> indices(queries.size(), -2);
    std::fill(distance.begin(), distance.end(), -1.0f);
    index.query(NearestNeighborIndex(queries), bound, distance, indices);
    EXPECT_EQ(distance, expected.distance) << "index against index";
    EXPECT_EQ(indices, expected.index) << "index against index";
  }

 private:
  std::optional<ScopedCpuLevel> level_;
};

TEST_P(NearestNeighborsEverywhere, MatchBruteForceOnSurfaces) {
  const Points targets = surface_points(7'001, 1), queries = surface_points(1'001, 2);
  for (const float bound : {0.0f, 0.005f, 0.1f, kNoBound}) expect_exact(targets, queries, bound);
}

TEST_P(NearestNeighborsEverywhere, MatchBruteForceInAVolume) {
  const Points targets = random_points(5'003, 3), queries = random_points(500, 4, 1.5f);
  for (const float bound : {0.02f, 0.3f, kNoBound}) expect_exact(targets, queries, bound);
}

TEST_P(NearestNeighborsEverywhere, MatchBruteForceForEverySmallNumberOfPoints) {
  for (size_t count : {1u, 2u, 15u, 16u, 17u, 33u, 255u, 256u, 257u}) {
    SCOPED_TRACE(count);
    const Points targets = random_points(count, 5), queries = random_points(count, 6);
    expect_exact(targets, queries, 0.5f);
    expect_exact(targets, queries, kNoBound);
  }
}

TEST_P(NearestNeighborsEverywhere, TheUnitMayHaveAnySize) {
  const Points targets = surface_points(3'001, 11), queries = surface_points(501, 12);
  const NearestNeighborIndex index(targets);
  for (const float bound : {0.05f, kNoBound}) {
    const NearestNeighbors expected = index.query(queries, bound);
    // Powers of two change no digit; squares of the smallest and largest would not be floats.
    for (const int exponent : {-110, -70, -41, 41, 70, 100}) {
      const auto scaled = [&](Points points) {
        for (Eigen::Vector3f& x : points) x *= std::ldexp(1.0f, exponent);
        return points;
      };
      const NearestNeighborIndex scaled_index(scaled(targets));
      NearestNeighbors found = scaled_index.query(scaled(queries), std::ldexp(bound, exponent));
      for (float& d : found.distance) d = std::ldexp(d, -exponent);
      EXPECT_EQ(found.distance, expected.distance) << exponent;
      EXPECT_EQ(found.index, expected.index) << exponent;
      scaled_index.query(NearestNeighborIndex(scaled(queries)), std::ldexp(bound, exponent),
                         found.distance, found.index);
      for (float& d : found.distance) d = std::ldexp(d, -exponent);
      EXPECT_EQ(found.distance, expected.distance) << "index against index, " << exponent;
    }
  }
}

TEST(NearestNeighbors, ScenesOfTwoSizesAreHeldAgainstEachOther) {
  // The targets are searched scaled, the queries' own index is not.
  const Points targets = {{1e-20f, 0, 0}, {2e-20f, 0, 0}, {0, 3e-20f, 0}};
  const Points queries = {{1.9e-20f, 0, 0}, {1, 0, 0}, {0, 2, 0}};
  const NearestNeighborIndex index(targets), others(queries);
  std::vector<float> distance(3);
  std::vector<int32_t> nearest(3);
  index.query(others, 1e-19f, distance, nearest);
  EXPECT_EQ(nearest, (std::vector<int32_t>{1, -1, -1}));
  EXPECT_NEAR(distance[0] * 1e21f, 1, 1e-5);
  EXPECT_EQ(distance[1], 1e-19f);
}

TEST_P(NearestNeighborsEverywhere, OfEquallyNearTargetsTheLowestIndexWins) {
  // Integer coordinates: distances are exact, nearly all of them tied, and every point occurs about
  // ten times.
  std::mt19937 random(7);
  std::uniform_int_distribution<int> coordinate(0, 6);
  const auto lattice = [&](size_t count, float offset) {
    Points points(count);
    for (auto& x : points) {
      for (int axis = 0; axis < 3; ++axis)
        x[axis] = static_cast<float>(coordinate(random)) + offset;
    }
    return points;
  };
  const Points targets = lattice(2'000, 0);
  expect_exact(targets, lattice(200, 0), kNoBound);
  expect_exact(targets, lattice(200, 0.5f), kNoBound);
  expect_exact(targets, lattice(200, 7), 1.0f);  // ties exactly at the bound
}

TEST_P(NearestNeighborsEverywhere, MatchBruteForceAmongDuplicates) {
  // One place with thousands of targets, another with one: what a bad depth map can look like.
  Points targets(4'000, Eigen::Vector3f(0.5f, 0.25f, -3));
  targets[1234] = {0.5f, 0.25f, -2};
  Points queries(300, Eigen::Vector3f(0.5f, 0.25f, -3));
  for (size_t i = 0; i < queries.size(); i += 7) queries[i].z() += static_cast<float>(i) / 300;
  for (const float bound : {0.0f, 0.1f, kNoBound}) expect_exact(targets, queries, bound);
}

TEST_P(NearestNeighborsEverywhere, MatchBruteForceOnAPlaneAndALine) {
  Points targets = random_points(3'000, 8), queries = random_points(500, 9);
  for (auto& x : targets) x.z() = 0.5f;
  expect_exact(targets, queries, 0.05f);
  for (auto& x : targets) x.y() = -2;
  expect_exact(targets, queries, kNoBound);
}

TEST_P(NearestNeighborsEverywhere, MatchBruteForceAtExtremeExtents) {
  for (const float extent : {1e-6f, 1e6f}) {
    const Points targets = random_points(2'000, 10, extent);
    const Points queries = random_points(500, 11, extent);
    expect_exact(targets, queries, 0.04f * extent);
    expect_exact(targets, queries, kNoBound);
  }
  // A scene of size 1e-6, a million units away from one stray point.
  Points targets = random_points(2'000, 12, 1e-6f);
  targets[77] = {1e6f, -1e6f, 3};
  expect_exact(targets, random_points(500, 13, 1e-6f), 4e-8f);
  expect_exact(targets, {{1e6f, -1e6f, 0}, {0, 0, 0}}, 10);
}

TEST_P(NearestNeighborsEverywhere, QueriesFarAwayFindTheNearestOrNothing) {
  Points queries = random_points(200, 14);
  for (auto& x : queries) x += Eigen::Vector3f(100, -50, 30);
  const Points targets = random_points(2'000, 15);
  expect_exact(targets, queries, kNoBound);
  expect_exact(targets, queries, 10);
  const NearestNeighbors nothing = NearestNeighborIndex(targets).query(queries, 10);
  EXPECT_EQ(nothing.distance, std::vector<float>(200, 10.0f));
  EXPECT_EQ(nothing.index, std::vector<int32_t>(200, -1));
}

TEST_P(NearestNeighborsEverywhere, TheBoundItselfIsWithinTheBound) {
  const Points targets{{0, 0, 0}, {10, 0, 0}};
  const Points queries{{3, 4, 0}};
  EXPECT_EQ(NearestNeighborIndex(targets).query(queries, 5.0f).index[0], 0);
  EXPECT_EQ(NearestNeighborIndex(targets).query(queries, std::nextafter(5.0f, 0.0f)).index[0], -1);
}

INSTANTIATE_TEST_SUITE_P(ThreadsAndInstructionSets, NearestNeighborsEverywhere,
                         ::testing::Combine(::testing::Values(1, 2, 5),
                                            ::testing::Values(CpuLevel::kReference, CpuLevel::kAvx2,
                                                              CpuLevel::kAvx512)),
                         [](const auto& instance) {
                           return std::string(enum_to_string(std::get<1>(instance.param))) + "_" +
                                  std::to_string(std::get<0>(instance.param)) + "_threads";
                         });

TEST(NearestNeighborIndex, WithoutTargetsNothingIsWithinAnyBound) {
  const NearestNeighborIndex index(Points{});
  EXPECT_EQ(index.size(), 0u);
  const NearestNeighbors found = index.query(Points{{1, 2, 3}}, kNoBound);
  EXPECT_EQ(found.distance[0], kNoBound);
  EXPECT_EQ(found.index[0], -1);
}

TEST(NearestNeighborIndex, WithoutQueriesThereIsNoAnswer) {
  EXPECT_TRUE(NearestNeighborIndex(random_points(20, 16)).query(Points{}).distance.empty());
}

TEST(NearestNeighborIndex, RefusesNonsense) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(NearestNeighborIndex(Points{{0, nan, 0}}), Error);
  const Points points = random_points(20, 17);
  const NearestNeighborIndex index(points);
  EXPECT_THROW(index.query(Points{{nan, 0, 0}}), Error);
  EXPECT_THROW(index.query(points, -1.0f), Error);
  EXPECT_THROW(index.query(points, nan), Error);
  std::vector<float> distance(19);
  EXPECT_THROW(index.query(points, 1.0f, distance), Error);
  distance.resize(20);
  std::vector<int32_t> indices(3);
  EXPECT_THROW(index.query(points, 1.0f, distance, indices), Error);
}

}  // namespace
}  // namespace vggtcd
