// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/geometry/hilbert_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <random>

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"

namespace vggtcd {
namespace {

using Points = std::vector<Eigen::Vector3f>;

// The corner cells [0, side)^3 are a stretch of the curve of their own for side a power of two.
TEST(HilbertKey, VisitsEveryCellOnceAndStepsToAFaceNeighbour) {
  constexpr uint32_t kSide = 32;
  std::vector<Eigen::Vector3i> cell_at(kSide * kSide * kSide, Eigen::Vector3i::Constant(-1));
  for (uint32_t x = 0; x < kSide; ++x) {
    for (uint32_t y = 0; y < kSide; ++y) {
      for (uint32_t z = 0; z < kSide; ++z) {
        const uint32_t key = hilbert_key(x, y, z);
        ASSERT_LT(key, cell_at.size());
        ASSERT_EQ(cell_at[key].x(), -1) << "two cells have key " << key;
        cell_at[key] = Eigen::Vector3<uint32_t>(x, y, z).cast<int>();
      }
    }
  }
  for (size_t key = 1; key < cell_at.size(); ++key) {
    ASSERT_EQ((cell_at[key] - cell_at[key - 1]).cwiseAbs().sum(), 1) << "at key " << key;
  }
}

TEST(HilbertKey, StepsToAFaceNeighbourAcrossTheWholeCube) {
  // Along the curve from cell to cell by trying all six neighbours, from places all over the cube.
  std::mt19937 random(1);
  std::uniform_int_distribution<uint32_t> coordinate(1, 1022);
  for (int trial = 0; trial < 1000; ++trial) {
    const uint32_t x = coordinate(random), y = coordinate(random), z = coordinate(random);
    const uint32_t key = hilbert_key(x, y, z);
    const uint32_t around[] = {hilbert_key(x - 1, y, z), hilbert_key(x + 1, y, z),
                               hilbert_key(x, y - 1, z), hilbert_key(x, y + 1, z),
                               hilbert_key(x, y, z - 1), hilbert_key(x, y, z + 1)};
    EXPECT_EQ(std::ranges::count(around, key - 1), 1);
    EXPECT_EQ(std::ranges::count(around, key + 1), 1);
  }
  EXPECT_EQ(std::max({hilbert_key(1023, 0, 0), hilbert_key(0, 1023, 0), hilbert_key(0, 0, 1023)}),
            (1u << 30) - 1);
}

Points random_points(size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> uniform(-1, 1);
  Points points(count);
  for (auto& x : points) x = {uniform(random), uniform(random), uniform(random)};
  return points;
}

std::vector<uint32_t> order_of(const Points& points, int64_t max_run) {
  std::vector<IndexedPoint> ordered(points.size());
  hilbert_order(PointArray(points), max_run, ordered);
  std::vector<uint32_t> indices;
  for (const IndexedPoint& p : ordered) {
    EXPECT_EQ(points[p.index], Eigen::Vector3f(p.x, p.y, p.z));
    indices.push_back(p.index);
  }
  return indices;
}

bool is_permutation_of_indices(std::vector<uint32_t> order, size_t count) {
  std::sort(order.begin(), order.end());
  std::vector<uint32_t> all(count);
  std::iota(all.begin(), all.end(), 0u);
  return order == all;
}

double path_length(const Points& points, const std::vector<uint32_t>& order) {
  double length = 0;
  for (size_t i = 1; i < order.size(); ++i) {
    length += (points[order[i]] - points[order[i - 1]]).norm();
  }
  return length;
}

class HilbertOrder : public ::testing::TestWithParam<int> {
 protected:
  void SetUp() override { set_num_threads(GetParam()); }
  void TearDown() override { set_num_threads(2); }
};

TEST_P(HilbertOrder, IsAShortPathThroughAllPoints) {
  const Points points = random_points(200'000, 2);
  const std::vector<uint32_t> order = order_of(points, 16);
  EXPECT_TRUE(is_permutation_of_indices(order, points.size()));
  // Random points in a cube of side 2 are 2 / 200000^(1/3) = 0.034 apart; a step of the curve is
  // about that, where a step in random order is 1.3.
  EXPECT_LT(path_length(points, order) / 200'000, 2 * 0.034);
}

TEST_P(HilbertOrder, AFarOutlierDoesNotSpoilTheRest) {
  Points points = random_points(200'000, 3);
  const double length = path_length(points, order_of(points, 16));
  points.emplace_back(1e6f, 1e6f, 1e6f);
  std::vector<uint32_t> order = order_of(points, 16);
  EXPECT_TRUE(is_permutation_of_indices(order, points.size()));
  std::erase(order, 200'000u);
  EXPECT_NEAR(path_length(points, order), length, 0.05 * length);
}

// More strays than the sample's percentiles cut off, and a place that holds most of the points.
TEST_P(HilbertOrder, DenseAndSparseParts) {
  Points points = random_points(200'000, 5);
  for (size_t i = 0; i < 100'000; ++i) points[2 * i] *= 1e-4f;
  for (size_t i = 0; i < 10'000; ++i) points[20 * i] = 100 * points[20 * i + 1];
  const std::vector<uint32_t> order = order_of(points, 16);
  EXPECT_TRUE(is_permutation_of_indices(order, points.size()));
  // As above: 10 000 strays in a cube of side 200, 100 000 points in one of side 2, the rest small.
  EXPECT_LT(path_length(points, order), 2 * (10'000 * 200 / 21.5 + 100'000 * 2 / 46.4));
}

TEST_P(HilbertOrder, DuplicatesStayInIndexOrder) {
  Points points(100'000, Eigen::Vector3f(1, 2, 3));
  std::vector<uint32_t> expected(points.size());
  std::iota(expected.begin(), expected.end(), 0u);
  EXPECT_EQ(order_of(points, 16), expected);
  // Twice the same random points: twins follow one another, the lower index first.
  points = random_points(5000, 4);
  points.insert(points.end(), points.begin(), points.end());
  const std::vector<uint32_t> order = order_of(points, 1);
  for (size_t i = 0; i < order.size(); i += 2) EXPECT_EQ(order[i] + 5000, order[i + 1]);
}

INSTANTIATE_TEST_SUITE_P(Threads, HilbertOrder, ::testing::Values(1, 2, 5));

TEST(HilbertOrderInput, EmptyAndOnePoint) {
  EXPECT_TRUE(order_of({}, 16).empty());
  EXPECT_EQ(order_of(Points{{1, 2, 3}}, 16), std::vector<uint32_t>{0});
}

TEST(HilbertOrderInput, RefusesWhatIsNotAPosition) {
  for (const float bad :
       {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 2e18f}) {
    EXPECT_THROW(order_of(Points{{0, 0, 0}, {0, bad, 0}}, 16), Error);
  }
}

}  // namespace
}  // namespace vggtcd
