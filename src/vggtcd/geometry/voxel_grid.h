// SPDX-License-Identifier: Apache-2.0
// Voxel grid: thins a cloud to the most confident point of each cubic cell ("Confidence-weighted
// voxel downsampling" of the paper).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

namespace vggtcd {

// The indices, ascending, of the most confident point of each occupied voxel (of equals the lowest
// index). A point belongs to voxel floor(x / voxel_size) per axis, evaluated in double. Positions
// are finite, confidences are not NaN, one per position. Throws Error{kDegenerate} if voxel_size is
// so small that voxel numbers leave the range of int32; Error{kInternal} unless voxel_size is
// positive and finite.
std::vector<uint32_t> voxel_downsample(std::span<const Eigen::Vector3f> positions,
                                       std::span<const float> confidence, double voxel_size);

// The indices, ascending, of all points that lie in the voxel of one of `members` (indices of
// points, in any order; they are among the result). The same voxels and the same errors.
std::vector<uint32_t> points_in_voxels_of(std::span<const Eigen::Vector3f> positions,
                                          std::span<const uint32_t> members, double voxel_size);

}  // namespace vggtcd
