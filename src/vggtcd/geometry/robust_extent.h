// SPDX-License-Identifier: Apache-2.0
// The size of a point cloud that a few stray points cannot change.
#pragma once

#include <Eigen/Core>
#include <span>

namespace vggtcd {

// The largest over the axes of the distance between the 1st and the 99th percentile of the
// coordinates (numpy's linear interpolation), in the unit of the points: L of the paper. Throws
// Error{kDegenerate} if there are no points or the extent is 0.
double robust_extent(std::span<const Eigen::Vector3f> positions);

}  // namespace vggtcd
