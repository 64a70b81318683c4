// SPDX-License-Identifier: Apache-2.0
// The search itself, written once over a type V of 16 floats and compiled per instruction set:
// 16 queries that are neighbours walk the tree of target boxes together. Internal to
// geometry/nearest_neighbors*.cc, each of which gets its own copy (unnamed namespace), compiled
// with its own flags.
//
// Why pruning is exact in floating point: rounding is monotone, so if a box contains a target p,
// then for every axis fl(max(low - q, q - high, 0)) <= |fl(p - q)|, and the sums of squares,
// evaluated in the same order without fused operations, keep that order. A box whose distance
// exceeds a query's best cannot hold a better point.
#pragma once

#include "vggtcd/geometry/nearest_neighbors_tree.h"

namespace vggtcd {
namespace {

constexpr int32_t kNoBlock = -1;
constexpr int kNoChild = -1;
constexpr uint32_t kAllLanes = 0xFFFF;
constexpr int kFewLanes = 4;  // up to as many queries are faster one at a time
constexpr int32_t kLowestIndexNotYetKnown = INT32_MAX;
constexpr float kLargestFloat = 3.402823466e+38f;

// V offers: load(const float*), all(float), store(float*), + - *, min, max, sqrt, less(V, V) and
// less_equal(V, V) and equal(V, V) -> V::Mask, bits(Mask) -> uint32_t, max_of(V), min_of(V),
// with_lane(V, int, float), assign(Mask, int32_t, int32_t*).
template <typename V>
class PacketSearch {
 public:
  PacketSearch(const NearestNeighborTree& tree, const NearestNeighborQuery& query)
      : tree_(tree), query_(query), want_index_(query.index != nullptr) {}

  void run() {
    int32_t seed = kNoBlock;
    for (int64_t packet = 0; packet < query_.num_blocks; ++packet) {
      start(query_.blocks[packet]);
      if (seed == kNoBlock) {
        visit_node(tree_.num_levels - 1, 0, kNoChild);
      } else {
        search_outward(seed);
      }
      finish();
      if (best_block_[kNearestNeighborLanes - 1] != kNoBlock) {
        seed = best_block_[kNearestNeighborLanes - 1];
      }
    }
  }

 private:
  // From a block that is likely near, up to the root, each time into what has not been visited: the
  // sooner the best are good, the less of the tree matters.
  void search_outward(int32_t block) {
    visit_block(block, kAllLanes);
    int64_t number = block;
    for (int level = 0; level < tree_.num_levels; ++level) {
      const int visited = static_cast<int>(number % kNearestNeighborLanes);
      number /= kNearestNeighborLanes;
      visit_node(level, number, visited);
    }
  }

  static V squared_length(V dx, V dy, V dz) { return (dx * dx + dy * dy) + dz * dz; }

  void start(const PointBlock& queries) {
    queries_ = &queries;
    x_ = V::load(queries.x);
    y_ = V::load(queries.y);
    z_ = V::load(queries.z);
    low_[0] = min_of(x_), low_[1] = min_of(y_), low_[2] = min_of(z_);
    high_[0] = max_of(x_), high_[1] = max_of(y_), high_[2] = max_of(z_);
    best_ = V::all(query_.squared_limit);
    worst_ = query_.squared_limit;
    for (int lane = 0; lane < kNearestNeighborLanes; ++lane) {
      best_block_[lane] = kNoBlock;
      best_index_[lane] = kLowestIndexNotYetKnown;
    }
    // Without indices an equally near target is of no interest: no index is below this.
    worst_index_ = want_index_ ? kLowestIndexNotYetKnown : INT32_MIN;
  }

  // Whether a box at this distance can hold something that changes the result of some query.
  bool matters(float squared_distance, int32_t min_index) const {
    return squared_distance < worst_ || (squared_distance == worst_ && min_index < worst_index_);
  }

  // Squared distances between the packet's box and those of the 16 children.
  V box_to_boxes(const BoxNode& node) const {
    V d[3];
    for (int axis = 0; axis < 3; ++axis) {
      const V above = V::load(node.low[axis]) - V::all(high_[axis]);
      const V below = V::all(low_[axis]) - V::load(node.high[axis]);
      d[axis] = max(max(above, below), V::all(0));
    }
    return squared_length(d[0], d[1], d[2]);
  }

  // The queries for which one child's box is near enough to matter.
  uint32_t lanes_near(const BoxNode& node, int child) const {
    const auto outside = [&](V q, int axis) {
      return max(max(V::all(node.low[axis][child]) - q, q - V::all(node.high[axis][child])),
                 V::all(0));
    };
    const V distances = squared_length(outside(x_, 0), outside(y_, 1), outside(z_, 2));
    return V::bits(less_equal(distances, best_));
  }

  // Visits the children of a node that matter, but for one.
  void visit_node(int level, int64_t number, int except_child) {
    const BoxNode& node = tree_.levels[level][number];
    const V distances = box_to_boxes(node);
    uint32_t pending = V::bits(less_equal(distances, V::all(worst_)));
    if (except_child != kNoChild) pending &= ~(1u << except_child);
    if (pending == 0) return;
    if (level == 0) {
      visit_blocks(node, static_cast<int32_t>(number * kNearestNeighborLanes), distances, pending);
    } else {
      visit_nodes(level - 1, node, number * kNearestNeighborLanes, distances, pending);
    }
  }

  // The nearest of the pending children first; it usually settles most of the others.
  void visit_nodes(int level, const BoxNode& parent, int64_t first, V distances, uint32_t pending) {
    alignas(64) float distance[kNearestNeighborLanes];
    distances.store(distance);
    const auto visit = [&](int child) {
      if (matters(distance[child], parent.min_index[child]) && lanes_near(parent, child) != 0) {
        visit_node(level, first + child, kNoChild);
      }
    };
    const V nearest = V::all(min_of(distances));
    if (const uint32_t at_nearest = V::bits(equal(distances, nearest)) & pending; at_nearest != 0) {
      const int child = __builtin_ctz(at_nearest);
      pending &= ~(1u << child);
      visit(child);
    }
    for (; pending != 0; pending &= pending - 1) visit(__builtin_ctz(pending));
  }

  void visit_blocks(const BoxNode& parent, int32_t first, V distances, uint32_t pending) {
    while (pending != 0) {
      const int child = __builtin_ctz(pending);
      pending &= pending - 1;
      const uint32_t lanes = lanes_near(parent, child);
      if (lanes == 0) continue;
      visit_block(first + child, lanes);
      pending &= V::bits(less_equal(distances, V::all(worst_)));
    }
  }

  // Squared distances of the 16 queries to the nearest target of a block, one target at a time.
  V nearest_to_all(const PointBlock& block) const {
    V nearest = V::all(kLargestFloat);
    for (int i = 0; i < kNearestNeighborLanes; ++i) {
      nearest = min(nearest, squared_length(V::all(block.x[i]) - x_, V::all(block.y[i]) - y_,
                                            V::all(block.z[i]) - z_));
    }
    return nearest;
  }

  // The same for some of the queries, one query at a time; the others get the largest float.
  V nearest_to_some(const PointBlock& block, uint32_t lanes) const {
    V nearest = V::all(kLargestFloat);
    for (; lanes != 0; lanes &= lanes - 1) {
      const int lane = __builtin_ctz(lanes);
      nearest = V::with_lane(nearest, lane, min_of(targets_to_query(block, lane)));
    }
    return nearest;
  }

  // Squared distances of the 16 targets of a block to one query.
  V targets_to_query(const PointBlock& block, int lane) const {
    return squared_length(V::load(block.x) - V::all(queries_->x[lane]),
                          V::load(block.y) - V::all(queries_->y[lane]),
                          V::load(block.z) - V::all(queries_->z[lane]));
  }

  // Holds a block against the queries for which it matters.
  void visit_block(int32_t number, uint32_t lanes) {
    const PointBlock& block = tree_.blocks[number];
    const V nearest = __builtin_popcount(lanes) <= kFewLanes ? nearest_to_some(block, lanes)
                                                             : nearest_to_all(block);
    const uint32_t equally_near = want_index_ ? V::bits(equal(nearest, best_)) : 0;
    const auto nearer = less(nearest, best_);
    best_ = min(best_, nearest);
    worst_ = max_of(best_);
    V::assign(nearer, number, best_block_);
    V::assign(nearer, kLowestIndexNotYetKnown, best_index_);
    if (want_index_ && V::bits(nearer) != 0) worst_index_ = kLowestIndexNotYetKnown;
    if (equally_near != 0) settle_ties(number, equally_near);
  }

  // These queries have equally near targets in this block and in their best one.
  void settle_ties(int32_t number, uint32_t lanes) {
    alignas(64) float best[kNearestNeighborLanes];
    best_.store(best);
    for (; lanes != 0; lanes &= lanes - 1) {
      const int lane = __builtin_ctz(lanes);
      if (best_block_[lane] == kNoBlock) continue;  // just beyond the bound
      learn_lowest_index(lane, best[lane]);
      const int32_t other = lowest_index_at(number, lane, best[lane]);
      if (other < best_index_[lane]) best_index_[lane] = other;
    }
    worst_index_ = best_index_[0];
    for (const int32_t index : best_index_)
      worst_index_ = index > worst_index_ ? index : worst_index_;
  }

  void learn_lowest_index(int lane, float squared_distance) {
    if (best_index_[lane] != kLowestIndexNotYetKnown) return;
    best_index_[lane] = lowest_index_at(best_block_[lane], lane, squared_distance);
  }

  // The lowest index in a block at exactly this distance from one query.
  int32_t lowest_index_at(int32_t number, int lane, float squared_distance) const {
    const PointBlock& block = tree_.blocks[number];
    const V d = targets_to_query(block, lane);
    int32_t lowest = kLowestIndexNotYetKnown;
    for (uint32_t hits = V::bits(equal(d, V::all(squared_distance))); hits != 0; hits &= hits - 1) {
      const int32_t index = block.index[__builtin_ctz(hits)];
      if (index < lowest) lowest = index;
    }
    return lowest;
  }

  void finish() {
    alignas(64) float squared[kNearestNeighborLanes], distance[kNearestNeighborLanes];
    best_.store(squared);
    sqrt(best_).store(distance);
    for (int lane = 0; lane < kNearestNeighborLanes; ++lane) {
      const int32_t query = queries_->index[lane];
      const bool found = best_block_[lane] != kNoBlock;
      query_.distance[query] =
          found && distance[lane] < query_.bound ? distance[lane] : query_.bound;
      if (!want_index_) continue;
      if (found) learn_lowest_index(lane, squared[lane]);
      query_.index[query] = found ? best_index_[lane] : -1;
    }
  }

  const NearestNeighborTree& tree_;
  const NearestNeighborQuery& query_;
  const bool want_index_;

  // The packet: 16 queries and their bounding box.
  const PointBlock* queries_ = nullptr;
  V x_, y_, z_;
  float low_[3], high_[3];

  // Of each query: squared distance to its best target so far, the block that holds it, and its
  // index, which is looked up late: only when a tie must be settled, or at the end.
  V best_;
  alignas(64) int32_t best_block_[kNearestNeighborLanes];
  alignas(64) int32_t best_index_[kNearestNeighborLanes];
  float worst_;          // the largest in best_
  int32_t worst_index_;  // a box of equal distance matters if it holds an index below this
};

}  // namespace
}  // namespace vggtcd
