// SPDX-License-Identifier: Apache-2.0
// Order statistics of large arrays: median and percentiles as numpy defines them, exact, parallel,
// in constant extra memory.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

namespace vggtcd {

// All functions: at least one value, none NaN (infinities are ordered like numbers);
// Error{kInternal} otherwise.

// The middle value, or the mean of the two middle ones (numpy.median, the same bits).
float median(std::span<const float> values);

// For each p in [0, 100]: the value at position p / 100 * (n - 1) of the sorted array, linearly
// interpolated in double (numpy.percentile, method "linear").
std::vector<double> percentiles(std::span<const float> values, std::span<const double> percents);

// The same per coordinate axis of a cloud: one column per entry of percents.
Eigen::Matrix3Xd percentiles(std::span<const Eigen::Vector3f> positions,
                             std::span<const double> percents);

// For a handful of doubles: the middle one, of an even number the upper of the two.
double middle_of(std::vector<double> values);

}  // namespace vggtcd
