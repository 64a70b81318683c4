// SPDX-License-Identifier: Apache-2.0
// Voxel grid by a map from voxel to its best point so far.
#include "vggtcd/geometry/voxel_grid.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "vggtcd/core/error.h"

namespace vggtcd {

std::vector<uint32_t> voxel_downsample(std::span<const Eigen::Vector3f> positions,
                                       std::span<const float> confidence, double voxel_size) {
  check(positions.size() == confidence.size(), "voxel_downsample: one confidence per position");
  check(voxel_size > 0 && std::isfinite(voxel_size), "voxel_downsample: voxel_size > 0");
  std::map<std::array<int32_t, 3>, uint32_t> best;
  for (uint32_t i = 0; i < positions.size(); ++i) {
    std::array<int32_t, 3> voxel;
    for (int axis = 0; axis < 3; ++axis) {
      const double number = std::floor(static_cast<double>(positions[i][axis]) / voxel_size);
      if (!(std::abs(number) < 2147483648.0)) {
        throw_error(
            ErrorCode::kDegenerate,
            "voxel grid: expected a voxel size above 2^-31 of the coordinates, found {} for "
            "coordinate {}; choose a coarser grid",
            voxel_size, positions[i][axis]);
      }
      voxel[static_cast<size_t>(axis)] = static_cast<int32_t>(number);
    }
    const auto [entry, inserted] = best.emplace(voxel, i);
    if (!inserted && confidence[i] > confidence[entry->second]) entry->second = i;
  }
  std::vector<uint32_t> kept;
  kept.reserve(best.size());
  for (const auto& [voxel, index] : best) kept.push_back(index);
  std::sort(kept.begin(), kept.end());
  return kept;
}

}  // namespace vggtcd
