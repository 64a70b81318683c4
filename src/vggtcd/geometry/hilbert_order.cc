// SPDX-License-Identifier: Apache-2.0
// Hilbert order by a table of the curve's 24 orientations and a parallel radix sort.
#include "vggtcd/geometry/hilbert_order.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"

namespace vggtcd {
namespace {

constexpr int kBitsPerAxis = 10;
constexpr float kCellsPerAxis = 1 << kBitsPerAxis;

// One step down the curve: in this orientation, octant 0..7 is the digit-th one visited, and the
// curve inside it has orientation next.
struct Step {
  uint8_t digit;
  uint8_t next;  // premultiplied by 8
};

constexpr uint32_t rotate_left(uint32_t bits, uint32_t by) {
  return ((bits << by) | (bits >> (3 - by))) & 7u;
}

// Orientation = 3 * entry corner + direction; Hamilton's e, d, T and the Gray code g.
constexpr std::array<Step, 24 * 8> make_steps() {
  std::array<Step, 24 * 8> steps{};
  for (uint32_t orientation = 0; orientation < 24; ++orientation) {
    const uint32_t entry = orientation / 3, direction = orientation % 3;
    const uint32_t turn = (direction + 1) % 3;
    for (uint32_t octant = 0; octant < 8; ++octant) {
      const uint32_t gray = rotate_left(octant ^ entry, (3 - turn) % 3);  // T: rotate right
      const uint32_t digit = gray ^ (gray >> 1) ^ (gray >> 2);            // inverse Gray code
      const uint32_t even = digit == 0 ? 0 : (digit - 1) / 2 * 2;
      const uint32_t entry_of_digit = even ^ (even >> 1);
      const uint32_t odd = digit == 0 ? 0 : (digit - 1) | 1u;
      const uint32_t direction_of_digit = static_cast<uint32_t>(std::countr_one(odd)) % 3;
      const uint32_t next_entry = entry ^ rotate_left(entry_of_digit, turn);
      const uint32_t next_direction = (direction + direction_of_digit + 1) % 3;
      steps[orientation * 8 + octant] = {
          static_cast<uint8_t>(digit), static_cast<uint8_t>((3 * next_entry + next_direction) * 8)};
    }
  }
  return steps;
}
constexpr std::array<Step, 24 * 8> kSteps = make_steps();

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
    return hilbert_key(static_cast<uint32_t>(cell.x()), static_cast<uint32_t>(cell.y()),
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

// Sorts from into to by the three 10-bit digits of the key, the least significant first. Each pass
// is stable, so items that start in index order end in index order within a key. Spoils from.
void radix_sort(std::span<Item> from, std::span<Item> to) {
  constexpr size_t kRadix = 1 << kBitsPerAxis;
  const int64_t size = static_cast<int64_t>(from.size());
  std::vector<std::array<uint32_t, kRadix>> starts(static_cast<size_t>(num_chunks(size, kGrain)));
  for (int pass = 0; pass < 3; ++pass) {
    const auto digit = [shift = 32 + pass * kBitsPerAxis](Item item) {
      return static_cast<size_t>(item >> shift) & (kRadix - 1);
    };
    parallel_for(size, kGrain, [&](int64_t begin, int64_t end) {
      auto& count = starts[static_cast<size_t>(begin / kGrain)];
      count.fill(0);
      for (int64_t i = begin; i < end; ++i) ++count[digit(from[static_cast<size_t>(i)])];
    });
    uint32_t start = 0;
    for (size_t value = 0; value < kRadix; ++value) {
      for (auto& chunk : starts) start += std::exchange(chunk[value], start);
    }
    parallel_for(size, kGrain, [&](int64_t begin, int64_t end) {
      auto& next = starts[static_cast<size_t>(begin / kGrain)];
      for (int64_t i = begin; i < end; ++i) {
        const Item item = from[static_cast<size_t>(i)];
        to[next[digit(item)]++] = item;
      }
    });
    std::swap(from, to);
  }
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
    const auto size = static_cast<int64_t>(items.size());
    std::span<Item> keyed = size < kGrain ? items : scratch;
    parallel_for(size, kGrain, [&](int64_t begin, int64_t end) {
      for (size_t i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
        const uint32_t index = index_of(items[i]);
        keyed[i] = Item{grid.key(positions_[index])} << 32 | index;
      }
    });
    if (size < kGrain) {
      std::sort(items.begin(), items.end());
    } else {
      radix_sort(scratch, items);
    }
    sort_long_runs(items, scratch);
  }

 private:
  struct Run {
    size_t begin, size;
  };

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

  void sort_long_runs(std::span<Item> items, std::span<Item> scratch) const {
    std::vector<Run> short_enough;  // for one thread
    for (size_t begin = 0, end = 0; begin < items.size(); begin = end) {
      const uint32_t key = key_of(items[begin]);
      while (end < items.size() && key_of(items[end]) == key) ++end;
      const size_t size = end - begin;
      if (size <= max_run_) continue;
      if (size > static_cast<size_t>(kGrain)) {
        sort(items.subspan(begin, size), scratch.subspan(begin, size));
      } else {
        short_enough.push_back({begin, size});
      }
    }
    parallel_for(static_cast<int64_t>(short_enough.size()), 64, [&](int64_t begin, int64_t end) {
      for (size_t i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
        const Run& run = short_enough[i];
        sort(items.subspan(run.begin, run.size), scratch.subspan(run.begin, run.size));
      }
    });
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
  uint32_t key = 0, orientation = 0;
  for (int bit = kBitsPerAxis - 1; bit >= 0; --bit) {
    const uint32_t octant = (x >> bit & 1u) | (y >> bit & 1u) << 1 | (z >> bit & 1u) << 2;
    const Step step = kSteps[orientation + octant];
    key = key << 3 | step.digit;
    orientation = step.next;
  }
  return key;
}

std::vector<uint32_t> hilbert_order(std::span<const Eigen::Vector3f> positions, int64_t max_run) {
  check(max_run >= 1, "hilbert_order: max_run >= 1");
  check_positions(positions);
  std::vector<Item> items(positions.size()), scratch(positions.size());
  std::iota(items.begin(), items.end(), Item{0});
  if (!items.empty()) HilbertSorter(positions, max_run).sort(items, scratch);
  scratch = {};
  std::vector<uint32_t> order(items.size());
  std::transform(items.begin(), items.end(), order.begin(), index_of);
  return order;
}

}  // namespace vggtcd
