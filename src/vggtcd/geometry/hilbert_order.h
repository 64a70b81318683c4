// SPDX-License-Identifier: Apache-2.0
// Hilbert order: points in an order in which neighbours in the list are neighbours in space.
// Curve as in C. Hamilton, "Compact Hilbert Indices", Dalhousie University CS-2006-07, section 2.
#pragma once

#include <cstdint>
#include <span>

#include "vggtcd/geometry/point_source.h"

namespace vggtcd {

// The position along a 3-D Hilbert curve of the cell (x, y, z), each in [0, 1024): in [0, 2^30).
// Cells that follow one another along the curve share a face.
uint32_t hilbert_key(uint32_t x, uint32_t y, uint32_t z);

// A point and its number among all points.
struct IndexedPoint {
  float x, y, z;
  uint32_t index;
};

// Writes the points to `ordered`, which has room for as many, along a Hilbert curve through the
// cube around most of them; strays follow the curve at its border. Where one of the 1024^3 cells
// holds more than max_run points, these follow a curve of their own through their bounding cube,
// and so on, so that neither strays nor places looked at from very near spoil the order of the
// rest. Points that this does not tell apart are in ascending order of index. The same on any
// number of threads. Positions are finite and below 1e18, else Error{kInternal}; at most 2^31 - 1
// of them. Needs little memory of its own, unless most of the points lie in a few of the cells.
void hilbert_order(const PointSource& points, int64_t max_run, std::span<IndexedPoint> ordered);

}  // namespace vggtcd
