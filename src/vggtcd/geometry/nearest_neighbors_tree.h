// SPDX-License-Identifier: Apache-2.0
// The memory layout that the nearest-neighbour index shares with its kernels: points in blocks of
// 16 and a tree of bounding boxes, 16 to a node. Internal to geometry/nearest_neighbors*.
#pragma once

#include <cstddef>
#include <cstdint>

namespace vggtcd {

constexpr int kNearestNeighborLanes = 16;

// 16 points that follow one another along the Hilbert curve. The last block of a cloud is filled up
// with copies of its last point, which changes no minimum and no lowest index.
struct alignas(64) PointBlock {
  float x[16], y[16], z[16];
  int32_t index[16];  // in the order in which the caller has them
};

// The bounding boxes of up to 16 children: blocks (level 0) or nodes of the level below. Child c of
// node n is number 16 n + c. Boxes of children that do not exist are empty: low = +infinity, high =
// -infinity.
struct alignas(64) BoxNode {
  float low[3][16], high[3][16];
  int32_t min_index[16];  // lowest index of a point inside
};

constexpr int kMaxTreeLevels = 8;  // 16^8 points > 2^31

struct NearestNeighborTree {
  const PointBlock* blocks;
  const BoxNode* levels[kMaxTreeLevels];  // levels[num_levels - 1] is the root, one node
  int num_levels;                         // at least 1
};

// A stretch of a cloud whose nearest neighbours are wanted, and where to write them (at the index
// of each query); index may be null.
struct NearestNeighborQuery {
  const PointBlock* blocks;
  int64_t num_blocks;
  float bound;
  float squared_limit;  // the least float whose root is above the bound; finite
  float* distance;
  int32_t* index;
};

// One kernel per instruction set; the same bits from each (nearest_neighbors_kernel.h).
void nearest_neighbors_reference(const NearestNeighborTree& tree,
                                 const NearestNeighborQuery& query);
void nearest_neighbors_avx2(const NearestNeighborTree& tree, const NearestNeighborQuery& query);
void nearest_neighbors_avx512(const NearestNeighborTree& tree, const NearestNeighborQuery& query);

}  // namespace vggtcd
