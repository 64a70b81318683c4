// SPDX-License-Identifier: Apache-2.0
// Splits a connected region of points where it is thin: things that touch, or that stray points
// connect, are regions of their own.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace vggtcd {

// Points of a region, as indices into arrays that others share.
using RegionPoints = std::vector<uint32_t>;

// The voxels of the region that hold at least min_density times the median number of points fall
// into pieces, joined when they touch. Pieces for which stands_alone is true are cores; what is
// left goes to the core of the nearest voxel. With less than two cores the region stays whole.
// Every point is in one part; parts are in the order of their first points, points in their old
// order. positions and voxel are by point; voxel: as connected_components numbers them with
// voxel_size.
std::vector<RegionPoints> split_region(
    const RegionPoints& region, std::span<const Eigen::Vector3f> positions,
    std::span<const uint32_t> voxel, double voxel_size, double min_density,
    const std::function<bool(const RegionPoints&)>& stands_alone);

// The points in voxels that hold at least min_density times the median number, in their old order.
RegionPoints dense_points(const RegionPoints& region, std::span<const uint32_t> voxel,
                          double min_density);

// The mean of the points of each voxel, in the order of the voxels: near photos do not outvote far
// ones.
std::vector<Eigen::Vector3f> voxel_means(const RegionPoints& points,
                                         std::span<const Eigen::Vector3f> positions,
                                         std::span<const uint32_t> voxel);

}  // namespace vggtcd
