// SPDX-License-Identifier: Apache-2.0
// The nearest-neighbour search for any processor: 16 floats in an array.
#include <cmath>

#include "vggtcd/geometry/nearest_neighbors_kernel.h"

namespace vggtcd {
namespace {

struct ArrayLanes {
  using Mask = uint32_t;
  float v[kNearestNeighborLanes];

  template <typename F>
  static ArrayLanes make(F&& value_of_lane) {
    ArrayLanes result;
    for (int i = 0; i < kNearestNeighborLanes; ++i) result.v[i] = value_of_lane(i);
    return result;
  }
  template <typename F>
  static Mask make_mask(F&& is_set) {
    Mask mask = 0;
    for (int i = 0; i < kNearestNeighborLanes; ++i) mask |= (is_set(i) ? 1u : 0u) << i;
    return mask;
  }
  static ArrayLanes load(const float* p) {
    return make([&](int i) { return p[i]; });
  }
  static ArrayLanes all(float value) {
    return make([&](int) { return value; });
  }
  static uint32_t bits(Mask mask) { return mask; }
  static void assign(Mask where, int32_t value, int32_t* p) {
    for (int i = 0; i < kNearestNeighborLanes; ++i) {
      if ((where >> i & 1u) != 0) p[i] = value;
    }
  }
  static ArrayLanes with_lane(ArrayLanes a, int lane, float value) {
    a.v[lane] = value;
    return a;
  }
  void store(float* p) const {
    for (int i = 0; i < kNearestNeighborLanes; ++i) p[i] = v[i];
  }
  friend ArrayLanes operator+(const ArrayLanes& a, const ArrayLanes& b) {
    return make([&](int i) { return a.v[i] + b.v[i]; });
  }
  friend ArrayLanes operator-(const ArrayLanes& a, const ArrayLanes& b) {
    return make([&](int i) { return a.v[i] - b.v[i]; });
  }
  friend ArrayLanes operator*(const ArrayLanes& a, const ArrayLanes& b) {
    return make([&](int i) { return a.v[i] * b.v[i]; });
  }
  friend ArrayLanes min(const ArrayLanes& a, const ArrayLanes& b) {
    return make([&](int i) { return a.v[i] < b.v[i] ? a.v[i] : b.v[i]; });
  }
  friend ArrayLanes max(const ArrayLanes& a, const ArrayLanes& b) {
    return make([&](int i) { return a.v[i] > b.v[i] ? a.v[i] : b.v[i]; });
  }
  friend ArrayLanes sqrt(const ArrayLanes& a) {
    return make([&](int i) { return std::sqrt(a.v[i]); });
  }
  friend float min_of(const ArrayLanes& a) {
    float least = a.v[0];
    for (const float value : a.v) least = value < least ? value : least;
    return least;
  }
  friend float max_of(const ArrayLanes& a) {
    float largest = a.v[0];
    for (const float value : a.v) largest = value > largest ? value : largest;
    return largest;
  }
  friend Mask less(const ArrayLanes& a, const ArrayLanes& b) {
    return make_mask([&](int i) { return a.v[i] < b.v[i]; });
  }
  friend Mask less_equal(const ArrayLanes& a, const ArrayLanes& b) {
    return make_mask([&](int i) { return a.v[i] <= b.v[i]; });
  }
  friend Mask equal(const ArrayLanes& a, const ArrayLanes& b) {
    return make_mask([&](int i) { return a.v[i] == b.v[i]; });
  }
};

}  // namespace

void nearest_neighbors_reference(const NearestNeighborTree& tree,
                                 const NearestNeighborQuery& query) {
  PacketSearch<ArrayLanes>(tree, query).run();
}

}  // namespace vggtcd
