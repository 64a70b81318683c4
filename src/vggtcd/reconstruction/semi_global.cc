// SPDX-License-Identifier: Apache-2.0
// Semi-global aggregation: two sweeps over the rows, four directions each; inner loops run along
// the planes of one pixel.
#include "vggtcd/reconstruction/semi_global.h"

#include <algorithm>
#include <cmath>

#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

// Costs of one direction for one row of pixels, with one plane of padding on either side so that
// the neighbours of the first and last plane exist and are never chosen.
class PathRow {
 public:
  PathRow(int width, int planes)
      : stride_(static_cast<size_t>(planes) + 2),
        values_(static_cast<size_t>(width) * stride_),
        smallest_(static_cast<size_t>(width)) {
    reset();
  }
  void reset() {
    std::fill(values_.begin(), values_.end(), kFar);
    std::fill(smallest_.begin(), smallest_.end(), uint16_t{0});
  }
  uint16_t* at(int x) { return values_.data() + static_cast<size_t>(x) * stride_ + 1; }
  const uint16_t* at(int x) const { return values_.data() + static_cast<size_t>(x) * stride_ + 1; }
  uint16_t& smallest(int x) { return smallest_[static_cast<size_t>(x)]; }
  uint16_t smallest(int x) const { return smallest_[static_cast<size_t>(x)]; }

 private:
  static constexpr uint16_t kFar = 0x3fff;
  size_t stride_;
  std::vector<uint16_t> values_;
  std::vector<uint16_t> smallest_;
};

// L(p, d) = C(p, d) + min(L(q, d), L(q, d +- 1) + P1, min_k L(q, k) + P2) - min_k L(q, k).
// Written to `to` and added to `sum`. Returns min_d L(p, d).
uint16_t step(const uint8_t* __restrict cost, const uint16_t* __restrict from,
              uint16_t from_smallest, int planes, uint16_t small_step, uint16_t large_step,
              uint16_t* __restrict to, uint16_t* __restrict sum) {
  const auto jump = static_cast<uint16_t>(from_smallest + large_step);
  uint16_t smallest = 0x7fff;
  for (int d = 0; d < planes; ++d) {
    const uint16_t side = std::min(from[d - 1], from[d + 1]);
    uint16_t way = std::min<uint16_t>(from[d], static_cast<uint16_t>(side + small_step));
    way = std::min(way, jump);
    const auto value = static_cast<uint16_t>(cost[d] + way - from_smallest);
    to[d] = value;
    sum[d] = static_cast<uint16_t>(sum[d] + value);
    smallest = std::min(smallest, value);
  }
  return smallest;
}

// The first pixel of a path: L = C.
uint16_t begin(const uint8_t* __restrict cost, int planes, uint16_t* __restrict to,
               uint16_t* __restrict sum) {
  uint16_t smallest = 0x7fff;
  for (int d = 0; d < planes; ++d) {
    to[d] = cost[d];
    sum[d] = static_cast<uint16_t>(sum[d] + cost[d]);
    smallest = std::min<uint16_t>(smallest, cost[d]);
  }
  return smallest;
}

}  // namespace

std::vector<uint16_t> aggregate_semi_global(const std::vector<uint8_t>& costs, int width,
                                            int height, int planes, const std::vector<float>& gray,
                                            const SemiGlobalOptions& options) {
  const size_t pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  const auto depth = static_cast<size_t>(planes);
  check(costs.size() == pixels * depth && gray.size() == pixels, "aggregate_semi_global: sizes");
  std::vector<uint16_t> sums(pixels * depth, 0);
  // Along the row, and from the row before: its pixel to the left, above, to the right.
  constexpr int kAcross = 3;
  const auto small_step = static_cast<uint16_t>(options.small_step);
  for (const int direction : {1, -1}) {  // down and to the right, then up and to the left
    PathRow along(width, planes);
    std::vector<PathRow> previous(kAcross, along), current(kAcross, along);
    for (int row = 0; row < height; ++row) {
      const int y = direction > 0 ? row : height - 1 - row;
      for (int column = 0; column < width; ++column) {
        const int x = direction > 0 ? column : width - 1 - column;
        const auto i = static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
        const uint8_t* cost = costs.data() + i * depth;
        uint16_t* sum = sums.data() + i * depth;
        const auto large_step = [&](size_t from) {
          const float edge = std::abs(gray[i] - gray[from]) / 8.0f;
          const float penalty = static_cast<float>(options.large_step) / std::max(1.0f, edge);
          return static_cast<uint16_t>(
              std::max(static_cast<float>(options.large_step_min), penalty));
        };
        const auto advance = [&](const PathRow& from, int from_x, bool inside, size_t from_pixel,
                                 PathRow& to) {
          to.smallest(x) = inside ? step(cost, from.at(from_x), from.smallest(from_x), planes,
                                         small_step, large_step(from_pixel), to.at(x), sum)
                                  : begin(cost, planes, to.at(x), sum);
        };
        const int behind = x - direction;
        const bool has_behind = behind >= 0 && behind < width;
        advance(along, behind, has_behind, i - static_cast<size_t>(direction), along);
        const auto above = i - static_cast<size_t>(direction * width);
        for (int k = 0; k < kAcross; ++k) {
          const int from_x = x + k - 1;
          const bool inside = row > 0 && from_x >= 0 && from_x < width;
          advance(previous[static_cast<size_t>(k)], from_x, inside,
                  above + static_cast<size_t>(k) - 1, current[static_cast<size_t>(k)]);
        }
      }
      std::swap(previous, current);
    }
  }
  return sums;
}

}  // namespace vggtcd
