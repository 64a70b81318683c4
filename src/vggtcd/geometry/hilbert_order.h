// SPDX-License-Identifier: Apache-2.0
// Hilbert order: points in an order in which neighbours in the list are neighbours in space.
// Curve as in C. Hamilton, "Compact Hilbert Indices", Dalhousie University CS-2006-07, section 2.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <utility>

#include "vggtcd/core/large_array.h"

namespace vggtcd {

// The position along a 3-D Hilbert curve of the cell (x, y, z), each in [0, 1024): in [0, 2^30).
// Cells that follow one another along the curve share a face.
uint32_t hilbert_key(uint32_t x, uint32_t y, uint32_t z);

// Indices of points, in an order along the curve.
class HilbertOrder {
 public:
  HilbertOrder() = default;
  // The lower half of each item is an index; the upper half served to sort.
  explicit HilbertOrder(LargeArray<uint64_t> items) : items_(std::move(items)) {}
  size_t size() const { return items_.size(); }
  uint32_t operator[](size_t i) const { return static_cast<uint32_t>(items_[i]); }

 private:
  LargeArray<uint64_t> items_;
};

// The indices of the points along a Hilbert curve through their bounding cube. Where one of the
// 1024^3 cells holds more than max_run points, these follow a curve of their own through their
// bounding cube, and so on, so that one far outlier does not spoil the order of the rest. Points
// that this does not tell apart are in ascending order of index. The same on any number of threads.
// Positions are finite, else Error{kInternal}; at most 2^31 - 1 of them. Needs 16 bytes per point
// while it runs.
HilbertOrder hilbert_order(std::span<const Eigen::Vector3f> positions, int64_t max_run);

}  // namespace vggtcd
