// SPDX-License-Identifier: Apache-2.0
// Hilbert order by a table of the curve's 24 orientations and a radix sort.
#include "vggtcd/geometry/hilbert_order.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <utility>
#include <vector>

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"

namespace vggtcd {
namespace {

constexpr int kBitsPerAxis = 10;
constexpr float kCellsPerAxis = 1 << kBitsPerAxis;

// One step down the curve: in this orientation, octant 0..7 is the digit-th one visited, and the
// curve inside it has orientation next.
struct Step {
  uint32_t digit;
  uint32_t next;
};

constexpr uint32_t rotate_left(uint32_t bits, uint32_t by) {
  return ((bits << by) | (bits >> (3 - by))) & 7u;
}

// Orientation = 3 * entry corner + direction; Hamilton's e, d, T and the Gray code g.
constexpr Step step(uint32_t orientation, uint32_t octant) {
  const uint32_t entry = orientation / 3, direction = orientation % 3;
  const uint32_t turn = (direction + 1) % 3;
  const uint32_t gray = rotate_left(octant ^ entry, (3 - turn) % 3);  // T: rotate right
  const uint32_t digit = gray ^ (gray >> 1) ^ (gray >> 2);            // inverse Gray code
  const uint32_t even = digit == 0 ? 0 : (digit - 1) / 2 * 2;
  const uint32_t odd = digit == 0 ? 0 : (digit - 1) | 1u;
  const uint32_t direction_of_digit = static_cast<uint32_t>(std::countr_one(odd)) % 3;
  const uint32_t next_entry = entry ^ rotate_left(even ^ (even >> 1), turn);
  return {digit, 3 * next_entry + (direction + direction_of_digit + 1) % 3};
}

// Two steps at once: entry 64 * orientation + 8 * octant + octant inside it holds both digits below
// and 64 * next orientation above bit 6.
constexpr std::array<uint32_t, 24 * 64> make_double_steps() {
  std::array<uint32_t, 24 * 64> steps{};
  for (uint32_t orientation = 0; orientation < 24; ++orientation) {
    for (uint32_t octants = 0; octants < 64; ++octants) {
      const Step first = step(orientation, octants / 8), second = step(first.next, octants % 8);
      steps[orientation * 64 + octants] = second.next << 12 | first.digit << 3 | second.digit;
    }
  }
  return steps;
}

// The ten bits of a coordinate, two zeros after each.
constexpr std::array<uint32_t, 1 << kBitsPerAxis> make_spread() {
  std::array<uint32_t, 1 << kBitsPerAxis> spread{};
  for (uint32_t value = 0; value < spread.size(); ++value) {
    for (int bit = 0; bit < kBitsPerAxis; ++bit) spread[value] |= (value >> bit & 1u) << 3 * bit;
  }
  return spread;
}

constexpr std::array<uint32_t, 24 * 64> kDoubleSteps = make_double_steps();
constexpr std::array<uint32_t, 1 << kBitsPerAxis> kSpread = make_spread();

inline uint32_t key_of_cell(uint32_t x, uint32_t y, uint32_t z) {
  const uint32_t octants = kSpread[x] | kSpread[y] << 1 | kSpread[z] << 2;
  uint32_t key = 0, orientation = 0;
  for (int shift = 24; shift >= 0; shift -= 6) {
    const uint32_t steps = kDoubleSteps[orientation | (octants >> shift & 63u)];
    key = key << 6 | (steps & 63u);
    orientation = steps >> 6;
  }
  return key;
}

struct Bounds {
  Eigen::Array3f low = Eigen::Array3f::Constant(std::numeric_limits<float>::infinity());
  Eigen::Array3f high = -low;
};

// The bounding cube of some points, divided into cells.
class CellGrid {
 public:
  explicit CellGrid(const Bounds& bounds)
      : low_(bounds.low),
        side_((bounds.high - bounds.low).maxCoeff()),
        cells_per_unit_(kCellsPerAxis / side_) {}
  // Whether there is anything to order.
  bool is_divisible() const {
    return side_ > 0 && cells_per_unit_ < std::numeric_limits<float>::max();
  }
  uint32_t key(const Eigen::Vector3f& x) const {
    const Eigen::Array3i cell =
        ((x.array() - low_) * cells_per_unit_).min(kCellsPerAxis - 1).cast<int>();
    return key_of_cell(static_cast<uint32_t>(cell.x()), static_cast<uint32_t>(cell.y()),
                       static_cast<uint32_t>(cell.z()));
  }

 private:
  Eigen::Array3f low_;
  float side_;
  float cells_per_unit_;
};

// A point's key above its index: sorting these numbers sorts by key, then by index.
using Item = uint64_t;
uint32_t index_of(Item item) { return static_cast<uint32_t>(item); }
uint32_t key_of(Item item) { return static_cast<uint32_t>(item >> 32); }

constexpr int64_t kGrain = 1 << 16;

// Moves items to their place by one digit of the key, keeping their order within a digit. Returns
// where each digit starts in to, and the end.
using Boundaries = std::array<uint32_t, (1 << kBitsPerAxis) + 1>;

std::unique_ptr<Boundaries> radix_pass(std::span<const Item> from, std::span<Item> to,
                                       int key_shift) {
  constexpr size_t kRadix = 1 << kBitsPerAxis;
  const auto digit = [shift = 32 + key_shift](Item item) {
    return static_cast<size_t>(item >> shift) & (kRadix - 1);
  };
  const int64_t size = static_cast<int64_t>(from.size());
  std::vector<std::array<uint32_t, kRadix>> starts(static_cast<size_t>(num_chunks(size, kGrain)));
  parallel_for(size, kGrain, [&](int64_t begin, int64_t end) {
    auto& count = starts[static_cast<size_t>(begin / kGrain)];
    for (int64_t i = begin; i < end; ++i) ++count[digit(from[static_cast<size_t>(i)])];
  });
  auto boundaries = std::make_unique<Boundaries>();
  uint32_t start = 0;
  for (size_t value = 0; value < kRadix; ++value) {
    (*boundaries)[value] = start;
    for (auto& chunk : starts) start += std::exchange(chunk[value], start);
  }
  boundaries->back() = start;
  parallel_for(size, kGrain, [&](int64_t begin, int64_t end) {
    auto& next = starts[static_cast<size_t>(begin / kGrain)];
    for (int64_t i = begin; i < end; ++i) {
      const Item item = from[static_cast<size_t>(i)];
      to[next[digit(item)]++] = item;
    }
  });
  return boundaries;
}

class HilbertSorter {
 public:
  HilbertSorter(std::span<const Eigen::Vector3f> positions, int64_t max_run)
      : positions_(positions), max_run_(static_cast<size_t>(max_run)) {}

  // Orders the items of a range, which are in index order, along the curve through their bounding
  // cube; then those that share a cell, recursively. scratch is as long as items.
  void sort(std::span<Item> items, std::span<Item> scratch) const {
    const CellGrid grid(bounds_of(items));
    if (!grid.is_divisible()) return;
    const bool few = items.size() < kFew;
    const std::span<Item> keyed = few ? items : scratch;
    parallel_for(static_cast<int64_t>(items.size()), kGrain, [&](int64_t begin, int64_t end) {
      for (size_t i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
        const uint32_t index = index_of(items[i]);
        keyed[i] = Item{grid.key(positions_[index])} << 32 | index;
      }
    });
    if (few) {
      std::sort(items.begin(), items.end());
      sort_long_runs(items, scratch);
    } else {
      sort_buckets(items, scratch, *radix_pass(scratch, items, 2 * kBitsPerAxis));
    }
  }

 private:
  static constexpr size_t kFew = 1024;

  Bounds bounds_of(std::span<const Item> items) const {
    const auto size = static_cast<int64_t>(items.size());
    std::vector<Bounds> partial(static_cast<size_t>(num_chunks(size, kGrain)));
    parallel_for(size, kGrain, [&](int64_t begin, int64_t end) {
      Bounds bounds;
      for (size_t i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
        const Eigen::Array3f x = positions_[index_of(items[i])].array();
        bounds.low = bounds.low.min(x);
        bounds.high = bounds.high.max(x);
      }
      partial[static_cast<size_t>(begin / kGrain)] = bounds;
    });
    Bounds all;
    for (const Bounds& bounds : partial) {
      all.low = all.low.min(bounds.low);
      all.high = all.high.max(bounds.high);
    }
    return all;
  }

  // The items are in 1024 buckets by the upper third of their key; most buckets fit in a cache.
  void sort_buckets(std::span<Item> items, std::span<Item> scratch,
                    const Boundaries& boundaries) const {
    const auto is_large = [&](size_t b) {
      return boundaries[b + 1] - boundaries[b] > static_cast<size_t>(4 * kGrain);
    };
    const auto sort_bucket = [&](size_t b) {
      const size_t begin = boundaries[b], size = boundaries[b + 1] - begin;
      sort_bucket_by_rest_of_key(items.subspan(begin, size), scratch.subspan(begin, size));
    };
    const size_t buckets = boundaries.size() - 1;
    for (size_t b = 0; b < buckets; ++b) {
      if (is_large(b)) sort_bucket(b);  // on all threads
    }
    parallel_for(static_cast<int64_t>(buckets), 1, [&](int64_t begin, int64_t) {
      if (!is_large(static_cast<size_t>(begin))) sort_bucket(static_cast<size_t>(begin));
    });
  }

  void sort_bucket_by_rest_of_key(std::span<Item> items, std::span<Item> scratch) const {
    if (items.size() < kFew) {
      std::sort(items.begin(), items.end());
    } else {
      radix_pass(items, scratch, 0);
      radix_pass(scratch, items, kBitsPerAxis);
    }
    sort_long_runs(items, scratch);
  }

  void sort_long_runs(std::span<Item> items, std::span<Item> scratch) const {
    for (size_t begin = 0, end = 0; begin < items.size(); begin = end) {
      const uint32_t key = key_of(items[begin]);
      while (end < items.size() && key_of(items[end]) == key) ++end;
      if (end - begin <= max_run_) continue;
      sort(items.subspan(begin, end - begin), scratch.subspan(begin, end - begin));
    }
  }

  std::span<const Eigen::Vector3f> positions_;
  size_t max_run_;
};

void check_positions(std::span<const Eigen::Vector3f> positions) {
  check(positions.size() <= std::numeric_limits<int32_t>::max(), "hilbert_order: < 2^31 points");
  parallel_for(static_cast<int64_t>(positions.size()), kGrain, [&](int64_t begin, int64_t end) {
    bool valid = true;
    for (size_t i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
      for (int axis = 0; axis < 3; ++axis) {
        valid &= std::abs(positions[i][axis]) < 1e18f;  // false for NaN
      }
    }
    check(valid, "hilbert_order: finite positions below 1e18");
  });
}

}  // namespace

uint32_t hilbert_key(uint32_t x, uint32_t y, uint32_t z) {
  check(std::max({x, y, z}) < 1u << kBitsPerAxis, "hilbert_key: coordinates below 1024");
  return key_of_cell(x, y, z);
}

HilbertOrder hilbert_order(std::span<const Eigen::Vector3f> positions, int64_t max_run) {
  check(max_run >= 1, "hilbert_order: max_run >= 1");
  check_positions(positions);
  const auto size = static_cast<int64_t>(positions.size());
  LargeArray<Item> items(positions.size());
  parallel_for(size, kGrain, [&](int64_t begin, int64_t end) {
    std::iota(items.begin() + begin, items.begin() + end, static_cast<Item>(begin));
  });
  if (size > 0) {
    LargeArray<Item> scratch(positions.size());
    HilbertSorter(positions, max_run).sort(items, scratch);
  }
  return HilbertOrder(std::move(items));
}

}  // namespace vggtcd
