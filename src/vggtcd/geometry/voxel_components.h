// SPDX-License-Identifier: Apache-2.0
// Connected components of a point cloud: points whose voxels touch belong together.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

namespace vggtcd {

struct VoxelComponents {
  // Per point. Voxels are numbered in an order that depends on their places alone; component -1:
  // the point's voxel has too few points and connects nothing.
  std::vector<uint32_t> voxel;
  std::vector<int32_t> component;  // 0-based, in the order of the components' first points
  int num_components = 0;
  uint32_t num_voxels = 0;
};

// A point belongs to voxel floor(x / voxel_size) per axis; voxels with at least min_points points
// are joined when they share a face, an edge or a corner. Finite positions; those more than 2^20
// voxels away from the origin are in voxels of the rim. Throws Error{kInternal} unless voxel_size
// is positive and finite.
VoxelComponents connected_components(std::span<const Eigen::Vector3f> positions, double voxel_size,
                                     int min_points);

}  // namespace vggtcd
