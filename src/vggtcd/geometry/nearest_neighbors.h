// SPDX-License-Identifier: Apache-2.0
// Nearest neighbours of millions of points in another cloud: Eq. 5 (fine registration) and Eq. 8
// (change score) of the paper, exact up to a bound.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "vggtcd/geometry/point_source.h"

namespace vggtcd {

// One entry per query, in the order of the queries. Where no target lies within the bound, index is
// -1 and distance is the bound itself.
struct NearestNeighbors {
  std::vector<float> distance;  // units of the positions
  std::vector<int32_t> index;   // into the targets
};

// An index over a fixed set of target points. Immutable once built: may be queried from anywhere.
//
// The answer is a function of the points alone: of all targets within the bound (distance <=
// bound), the nearest; of equally near ones the lowest index. Distances are sqrt((dx dx + dy dy) +
// dz dz) evaluated in float without fused operations, and "nearest" and "equally near" refer to
// that number, so the result has the same bits for any number of threads and any instruction set.
//
// Positions are finite (Error{kInternal} otherwise: readers refuse NaN). Their unit may have any
// size; against the size of most targets (against 1, if that lies between 1e-12 and 1e12) positions
// are below 1e18, so that squares do not overflow, and distances below 1e-19 are zero. At most
// 2^31 - 1 targets.
class NearestNeighborIndex {
 public:
  static constexpr float kNoBound = std::numeric_limits<float>::infinity();

  // Copies the targets: about 18 bytes each, hardly more while building.
  explicit NearestNeighborIndex(std::span<const Eigen::Vector3f> targets);
  explicit NearestNeighborIndex(const PointSource& targets);
  ~NearestNeighborIndex();
  NearestNeighborIndex(NearestNeighborIndex&&) noexcept;
  NearestNeighborIndex& operator=(NearestNeighborIndex&&) noexcept;

  size_t size() const;  // targets

  // Writes distance[i], and index[i] unless that span is empty (which saves a little time), for
  // every query. bound >= 0, may be kNoBound. Without targets nothing is within any bound.
  void query(std::span<const Eigen::Vector3f> queries, float bound, std::span<float> distance,
             std::span<int32_t> index = {}) const;

  // The same in one struct.
  NearestNeighbors query(std::span<const Eigen::Vector3f> queries, float bound = kNoBound) const;

  // The same for the points that another index was built on, in their original order; cheaper,
  // because the other index has already brought them into a good order.
  void query(const NearestNeighborIndex& queries, float bound, std::span<float> distance,
             std::span<int32_t> index = {}) const;

 private:
  struct Impl;
  std::unique_ptr<const Impl> impl_;
};

}  // namespace vggtcd
