// SPDX-License-Identifier: Apache-2.0
// Connected components by sorting the voxels and joining neighbours (union-find).
#include "vggtcd/geometry/voxel_components.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

constexpr int64_t kHalfRange = int64_t{1} << 20;  // 21 bits per axis
constexpr uint64_t kAxisMask = (uint64_t{1} << 21) - 1;

uint64_t key_of(const Eigen::Vector3f& position, double voxel_size) {
  uint64_t key = 0;
  for (int axis = 0; axis < 3; ++axis) {
    // One voxel of margin, so that a neighbour's number never runs into the next axis.
    const double cell =
        std::clamp(std::floor(static_cast<double>(position[axis]) / voxel_size),
                   static_cast<double>(1 - kHalfRange), static_cast<double>(kHalfRange - 2));
    key = (key << 21) | static_cast<uint64_t>(static_cast<int64_t>(cell) + kHalfRange);
  }
  return key;
}

uint32_t root_of(std::vector<uint32_t>& parent, uint32_t i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

// The 13 of the 26 neighbours with a larger key.
std::vector<uint64_t> forward_neighbors(uint64_t key) {
  std::vector<uint64_t> neighbors;
  for (const int dx : {-1, 0, 1}) {
    for (const int dy : {-1, 0, 1}) {
      for (const int dz : {-1, 0, 1}) {
        const uint64_t x = (key >> 42) + static_cast<uint64_t>(dx);
        const uint64_t y = ((key >> 21) & kAxisMask) + static_cast<uint64_t>(dy);
        const uint64_t z = (key & kAxisMask) + static_cast<uint64_t>(dz);
        const uint64_t neighbor = x << 42 | y << 21 | z;
        if (neighbor > key) neighbors.push_back(neighbor);
      }
    }
  }
  return neighbors;
}

}  // namespace

VoxelComponents connected_components(std::span<const Eigen::Vector3f> positions, double voxel_size,
                                     int min_points) {
  check(voxel_size > 0 && std::isfinite(voxel_size), "connected_components: voxel_size > 0");
  VoxelComponents result;
  std::vector<uint64_t> keys(positions.size());
  for (size_t i = 0; i < positions.size(); ++i) keys[i] = key_of(positions[i], voxel_size);
  std::vector<uint64_t> voxels = keys;
  std::ranges::sort(voxels);
  voxels.erase(std::unique(voxels.begin(), voxels.end()), voxels.end());
  result.num_voxels = static_cast<uint32_t>(voxels.size());

  const auto number_of = [&](uint64_t key) -> int64_t {
    const auto found = std::ranges::lower_bound(voxels, key);
    return found != voxels.end() && *found == key ? found - voxels.begin() : -1;
  };
  std::vector<int> count(voxels.size());
  result.voxel.resize(positions.size());
  for (size_t i = 0; i < positions.size(); ++i) {
    result.voxel[i] = static_cast<uint32_t>(number_of(keys[i]));
    ++count[result.voxel[i]];
  }
  std::vector<uint32_t> parent(voxels.size());
  std::iota(parent.begin(), parent.end(), 0u);
  for (uint32_t v = 0; v < result.num_voxels; ++v) {
    if (count[v] < min_points) continue;
    for (const uint64_t key : forward_neighbors(voxels[v])) {
      const int64_t neighbor = number_of(key);
      if (neighbor < 0 || count[static_cast<size_t>(neighbor)] < min_points) continue;
      parent[root_of(parent, static_cast<uint32_t>(neighbor))] = root_of(parent, v);
    }
  }
  std::vector<int32_t> component_of_root(voxels.size(), -1);
  result.component.assign(positions.size(), -1);
  for (size_t i = 0; i < positions.size(); ++i) {
    if (count[result.voxel[i]] < min_points) continue;
    int32_t& component = component_of_root[root_of(parent, result.voxel[i])];
    if (component < 0) component = result.num_components++;
    result.component[i] = component;
  }
  return result;
}

}  // namespace vggtcd
