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

}  // namespace vggtcd
