// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/geometry/order_statistics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"

namespace vggtcd {
namespace {

std::vector<float> random_values(size_t count, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> normal;
  std::vector<float> values(count);
  // Signs, and sizes from about 1e-15 to 1e15: all bins of a histogram by bits.
  for (float& value : values) value = normal(random) * std::pow(10.0f, 4 * normal(random));
  return values;
}

// numpy's definition on a sorted copy.
double percentile_by_sorting(std::vector<float> values, double percent) {
  std::sort(values.begin(), values.end());
  const double position = percent / 100 * static_cast<double>(values.size() - 1);
  const auto below = static_cast<size_t>(position);
  const double low = values[below], high = values[std::min(below + 1, values.size() - 1)];
  return low + (high - low) * (position - static_cast<double>(below));
}

TEST(MiddleOf, IsTheMiddleOrTheUpperOfTheTwoMiddleValues) {
  EXPECT_EQ(middle_of({3}), 3);
  EXPECT_EQ(middle_of({5, 1, 4}), 4);
  EXPECT_EQ(middle_of({2, 9, -1, 7}), 7);
  EXPECT_THROW(middle_of({}), Error);
}

class OrderStatistics : public ::testing::TestWithParam<int> {
 protected:
  void SetUp() override { set_num_threads(GetParam()); }
  void TearDown() override { set_num_threads(2); }
};

TEST_P(OrderStatistics, MatchSorting) {
  const std::vector<double> percents{0, 1, 12.5, 50, 99, 99.9, 100};
  for (const size_t count : {1u, 2u, 3u, 10u, 1000u, 300'001u}) {
    const std::vector<float> values = random_values(count, static_cast<unsigned>(count));
    const std::vector<double> found = percentiles(values, percents);
    for (size_t i = 0; i < percents.size(); ++i) {
      EXPECT_EQ(found[i], percentile_by_sorting(values, percents[i]))
          << percents[i] << " of " << count;
    }
    EXPECT_EQ(median(values), static_cast<float>(percentile_by_sorting(values, 50)));
  }
}

TEST_P(OrderStatistics, PerAxisOfACloud) {
  const std::vector<float> values = random_values(3 * 70'000, 4);
  std::vector<Eigen::Vector3f> positions;
  std::vector<float> axes[3];
  for (size_t i = 0; i < values.size(); i += 3) {
    positions.emplace_back(values[i], values[i + 1], values[i + 2]);
    for (size_t axis = 0; axis < 3; ++axis) axes[axis].push_back(values[i + axis]);
  }
  const std::vector<double> percents{1, 99};
  const Eigen::Matrix3Xd found = percentiles(positions, percents);
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_EQ(found(axis, 0), percentile_by_sorting(axes[axis], 1));
    EXPECT_EQ(found(axis, 1), percentile_by_sorting(axes[axis], 99));
  }
}

TEST_P(OrderStatistics, OneValueManyTimes) {
  const std::vector<float> values(200'000, -1.25f);
  EXPECT_EQ(median(values), -1.25f);
  EXPECT_EQ(percentiles(values, std::vector<double>{33.3})[0], -1.25);
}

INSTANTIATE_TEST_SUITE_P(Threads, OrderStatistics, ::testing::Values(1, 2, 5));

TEST(Median, IsTheMeanOfTheTwoMiddleValues) {
  EXPECT_EQ(median(std::vector<float>{4, 1, 3, 2}), 2.5f);
  EXPECT_EQ(median(std::vector<float>{-0.0f, 0.0f}), 0.0f);
  // The sum would overflow in float.
  EXPECT_EQ(median(std::vector<float>{3e38f, 3e38f}), 3e38f);
  // numpy.median(numpy.array([0.1, 0.2], numpy.float32)) is 0.15 rounded to float.
  EXPECT_EQ(median(std::vector<float>{0.2f, 0.1f}), 0.15f);
}

TEST(Median, OrdersInfinities) {
  const float inf = std::numeric_limits<float>::infinity();
  EXPECT_EQ(median(std::vector<float>{inf, -inf, 7}), 7);
  EXPECT_EQ(median(std::vector<float>{inf, inf, 7}), inf);
}

TEST(OrderStatisticsInput, RefusesNanEmptyAndBadPercents) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(median(std::vector<float>{1, nan}), Error);
  EXPECT_THROW(median(std::vector<float>{}), Error);
  EXPECT_THROW(percentiles(std::vector<float>{1}, std::vector<double>{101}), Error);
  EXPECT_THROW(percentiles(std::vector<Eigen::Vector3f>{}, std::vector<double>{1}), Error);
}

}  // namespace
}  // namespace vggtcd
