// SPDX-License-Identifier: Apache-2.0
// Order statistics by selection on a copy.
#include "vggtcd/geometry/order_statistics.h"

#include <algorithm>
#include <cmath>

#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

float select(std::vector<float>& values, size_t rank) {
  const auto position = values.begin() + static_cast<std::ptrdiff_t>(rank);
  std::nth_element(values.begin(), position, values.end());
  return *position;
}

}  // namespace

float median(std::span<const float> values) {
  check(!values.empty(), "median: at least one value");
  std::vector<float> copy(values.begin(), values.end());
  const size_t n = copy.size();
  const double low = select(copy, (n - 1) / 2), high = select(copy, n / 2);
  return static_cast<float>((low + high) / 2);
}

std::vector<double> percentiles(std::span<const float> values, std::span<const double> percents) {
  check(!values.empty(), "percentiles: at least one value");
  std::vector<float> copy(values.begin(), values.end());
  std::vector<double> result;
  for (const double percent : percents) {
    check(percent >= 0 && percent <= 100, "percentiles: 0 <= percent <= 100");
    const double position = percent / 100 * static_cast<double>(copy.size() - 1);
    const size_t below = static_cast<size_t>(position);
    const double low = select(copy, below);
    const double high = select(copy, std::min(below + 1, copy.size() - 1));
    result.push_back(low + (high - low) * (position - std::floor(position)));
  }
  return result;
}

Eigen::Matrix3Xd percentiles(std::span<const Eigen::Vector3f> positions,
                             std::span<const double> percents) {
  Eigen::Matrix3Xd result(3, static_cast<Eigen::Index>(percents.size()));
  std::vector<float> values(positions.size());
  for (int axis = 0; axis < 3; ++axis) {
    for (size_t i = 0; i < values.size(); ++i) values[i] = positions[i][axis];
    const std::vector<double> row = percentiles(values, percents);
    for (size_t i = 0; i < row.size(); ++i) result(axis, static_cast<Eigen::Index>(i)) = row[i];
  }
  return result;
}

}  // namespace vggtcd
