// SPDX-License-Identifier: Apache-2.0
// coordinate: which numbers a file may have for where something is, one answer for all readers.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <string_view>

namespace vggtcd {

// Beyond it a double does not resolve a thousandth of the unit, and what is computed from such
// numbers (squares, means, inverse poses) means nothing or overflows. Earth-centred coordinates in
// micrometres would still fit.
inline constexpr double kLargestCoordinate = 1e13;
inline constexpr std::string_view kCoordinateRange = "coordinates from -1e13 to 1e13";

inline bool is_coordinate(double value) {  // false for NaN
  return std::abs(value) <= kLargestCoordinate;
}

template <typename Derived>
bool are_coordinates(const Eigen::MatrixBase<Derived>& values) {
  return values.unaryExpr([](double value) { return is_coordinate(value) ? 1.0 : 0.0; })
             .minCoeff() > 0;
}

}  // namespace vggtcd
