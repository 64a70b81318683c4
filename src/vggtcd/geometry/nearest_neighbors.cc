// SPDX-License-Identifier: Apache-2.0
// Nearest neighbours by comparing all pairs.
#include "vggtcd/geometry/nearest_neighbors.h"

#include <algorithm>
#include <cmath>

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"

namespace vggtcd {

NearestNeighborIndex::NearestNeighborIndex(std::span<const Eigen::Vector3f> targets)
    : targets_(targets.begin(), targets.end()) {
  for (const Eigen::Vector3f& x : targets_)
    check(x.allFinite(), "nearest neighbors: finite targets");
}

void NearestNeighborIndex::query(std::span<const Eigen::Vector3f> queries, float bound,
                                 std::span<float> distance, std::span<int32_t> index) const {
  check(bound >= 0, "nearest neighbors: bound >= 0");
  check(distance.size() == queries.size(), "nearest neighbors: one distance per query");
  check(index.empty() || index.size() == queries.size(), "nearest neighbors: one index per query");
  parallel_for(static_cast<int64_t>(queries.size()), 256, [&](int64_t begin, int64_t end) {
    for (size_t i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
      float best = bound * bound;
      int32_t best_index = -1;
      for (size_t j = 0; j < targets_.size(); ++j) {
        const Eigen::Vector3f d = targets_[j] - queries[i];
        const float squared = d.x() * d.x() + d.y() * d.y() + d.z() * d.z();
        if (squared < best || (squared == best && best_index < 0)) {
          best = squared;
          best_index = static_cast<int32_t>(j);
        }
      }
      distance[i] = best_index < 0 ? bound : std::min(bound, std::sqrt(best));
      if (!index.empty()) index[i] = best_index;
    }
  });
}

NearestNeighbors NearestNeighborIndex::query(std::span<const Eigen::Vector3f> queries,
                                             float bound) const {
  NearestNeighbors result;
  result.distance.resize(queries.size());
  result.index.resize(queries.size());
  query(queries, bound, result.distance, result.index);
  return result;
}

void NearestNeighborIndex::query(const NearestNeighborIndex& queries, float bound,
                                 std::span<float> distance, std::span<int32_t> index) const {
  query(std::span(queries.targets_), bound, distance, index);
}

}  // namespace vggtcd
