// SPDX-License-Identifier: Apache-2.0
// The size of a point cloud that a few stray points cannot change.
#include "vggtcd/geometry/robust_extent.h"

#include "vggtcd/core/error.h"
#include "vggtcd/geometry/order_statistics.h"

namespace vggtcd {

double robust_extent(std::span<const Eigen::Vector3f> positions) {
  if (positions.empty()) throw_error(ErrorCode::kDegenerate, "no points to measure the extent of");
  constexpr double kPercents[] = {1.0, 99.0};
  const Eigen::Matrix3Xd limits = percentiles(positions, kPercents);
  const double extent = (limits.col(1) - limits.col(0)).maxCoeff();
  if (!(extent > 0)) {
    throw_error(ErrorCode::kDegenerate, "the {} points all lie in one place; expected a scene",
                positions.size());
  }
  return extent;
}

}  // namespace vggtcd
