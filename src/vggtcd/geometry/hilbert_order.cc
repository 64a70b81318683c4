// SPDX-License-Identifier: Apache-2.0
// Hilbert order by a table of the curve's 24 orientations: points go to buckets of a coarse curve,
// most of which fit in a cache, and are sorted there.
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

// The first `double_steps` of the five digit pairs of a cell's key.
template <int double_steps>
inline uint32_t key_of_cell(uint32_t x, uint32_t y, uint32_t z) {
  const uint32_t octants = kSpread[x] | kSpread[y] << 1 | kSpread[z] << 2;
  uint32_t key = 0, orientation = 0;
  for (int step = 0; step < double_steps; ++step) {
    const uint32_t steps = kDoubleSteps[orientation | (octants >> (24 - 6 * step) & 63u)];
    key = key << 6 | (steps & 63u);
    orientation = steps >> 6;
  }
  return key;
}

constexpr int kDoubleStepsOfKey = 5, kDoubleStepsOfBucket = 2;
constexpr size_t kBuckets = 1 << 6 * kDoubleStepsOfBucket;

struct Bounds {
  Eigen::Array3f low = Eigen::Array3f::Constant(std::numeric_limits<float>::infinity());
  Eigen::Array3f high = -low;
};

Eigen::Array3f array_of(const Eigen::Vector3f& x) { return x.array(); }
Eigen::Array3f array_of(const IndexedPoint& p) { return {p.x, p.y, p.z}; }

constexpr int64_t kGrain = 1 << 16;

template <typename Point>
Bounds bounds_of(std::span<Point> points) {
  const auto size = static_cast<int64_t>(points.size());
  std::vector<Bounds> partial(static_cast<size_t>(num_chunks(size, kGrain)));
  parallel_for(size, kGrain, [&](int64_t begin, int64_t end) {
    Bounds bounds;
    for (size_t i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
      bounds.low = bounds.low.min(array_of(points[i]));
      bounds.high = bounds.high.max(array_of(points[i]));
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

// The box of most points, by the 2nd and 98th percentile of a sample, with a margin. What it leaves
// out costs a little order at its border; a box of all points could be mostly empty.
Bounds bounds_of_most(std::span<const Eigen::Vector3f> points) {
  constexpr size_t kSample = 4096;
  const size_t stride = std::max<size_t>(1, points.size() / kSample);
  Bounds bounds;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<float> sample;
    for (size_t i = 0; i < points.size(); i += stride) sample.push_back(points[i][axis]);
    std::ranges::sort(sample);
    const float low = sample[sample.size() / 50],
                high = sample[sample.size() - 1 - sample.size() / 50];
    const float margin = (high - low) / 4;
    bounds.low[axis] = low - margin;
    bounds.high[axis] = high + margin;
  }
  return bounds;
}

// A cube divided into cells; what is outside counts to the nearest cell.
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
  uint32_t key(const Eigen::Array3f& x) const { return key<kDoubleStepsOfKey>(x); }
  size_t bucket(const Eigen::Array3f& x) const { return key<kDoubleStepsOfBucket>(x); }

 private:
  template <int double_steps>
  uint32_t key(const Eigen::Array3f& x) const {
    const Eigen::Array3i cell =
        ((x - low_) * cells_per_unit_).max(0.0f).min(kCellsPerAxis - 1).cast<int>();
    return key_of_cell<double_steps>(static_cast<uint32_t>(cell.x()),
                                     static_cast<uint32_t>(cell.y()),
                                     static_cast<uint32_t>(cell.z()));
  }

  Eigen::Array3f low_;
  float side_;
  float cells_per_unit_;
};

// A point's key above its place: sorting these numbers sorts by key, then by place.
using Item = uint64_t;
uint32_t place_of(Item item) { return static_cast<uint32_t>(item); }
uint32_t key_of(Item item) { return static_cast<uint32_t>(item >> 32); }

// Stable counting sort on all threads, by chunks: bucket_of(i) < buckets, move(i, place). Returns
// where each bucket starts, and the end.
template <typename BucketOf, typename Move>
std::vector<uint32_t> distribute(size_t size, size_t buckets, const BucketOf& bucket_of,
                                 const Move& move) {
  const auto count = static_cast<int64_t>(size);
  std::vector<uint32_t> next(static_cast<size_t>(num_chunks(count, kGrain)) * buckets, 0);
  const auto of_chunk = [&](int64_t begin) {
    return next.data() + static_cast<size_t>(begin / kGrain) * buckets;
  };
  parallel_for(count, kGrain, [&](int64_t begin, int64_t end) {
    uint32_t* counts = of_chunk(begin);
    for (size_t i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
      ++counts[bucket_of(i)];
    }
  });
  std::vector<uint32_t> starts(buckets + 1);
  uint32_t start = 0;
  for (size_t bucket = 0; bucket < buckets; ++bucket) {
    starts[bucket] = start;
    for (size_t i = bucket; i < next.size(); i += buckets) start += std::exchange(next[i], start);
  }
  starts.back() = start;
  parallel_for(count, kGrain, [&](int64_t begin, int64_t end) {
    uint32_t* places = of_chunk(begin);
    for (size_t i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
      move(i, places[bucket_of(i)]++);
    }
  });
  return starts;
}

// Orders some of the points; owns the memory that takes.
class RangeSorter {
 public:
  explicit RangeSorter(int64_t max_run) : max_run_(static_cast<size_t>(max_run)) {}

  // The points are in index order and differ in the last `key_bits` bits of their key only.
  void sort(std::span<IndexedPoint> points, const CellGrid& grid, int key_bits) {
    if (points.size() < 2) return;
    items_.resize(points.size());
    copy_.resize(points.size());
    parallel_for(static_cast<int64_t>(points.size()), kGrain, [&](int64_t begin, int64_t end) {
      for (size_t i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
        items_[i] = Item{grid.key(array_of(points[i]))} << 32 | i;
        copy_[i] = points[i];
      }
    });
    sort_items(key_bits);
    parallel_for(static_cast<int64_t>(points.size()), kGrain, [&](int64_t begin, int64_t end) {
      for (size_t i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
        points[i] = copy_[place_of(items_[i])];
      }
    });
    sort_long_runs(points);
  }

 private:
  void sort_items(int key_bits) {
    constexpr int kDigitBits = 9;
    constexpr size_t kFew = 1024;
    if (items_.size() < kFew) {
      std::ranges::sort(items_);
      return;
    }
    moved_.resize(items_.size());
    for (int shift = 32; shift < 32 + key_bits; shift += kDigitBits) {
      distribute(
          items_.size(), size_t{1} << kDigitBits,
          [&](size_t i) { return items_[i] >> shift & ((1u << kDigitBits) - 1); },
          [&](size_t i, size_t place) { moved_[place] = items_[i]; });
      items_.swap(moved_);
    }
  }

  // Of the points that share a cell.
  void sort_long_runs(std::span<IndexedPoint> points) {
    std::vector<std::span<IndexedPoint>> runs;
    for (size_t begin = 0, end = 0; begin < points.size(); begin = end) {
      while (end < points.size() && key_of(items_[end]) == key_of(items_[begin])) ++end;
      if (end - begin > max_run_) runs.push_back(points.subspan(begin, end - begin));
    }
    for (const std::span<IndexedPoint> run : runs) {
      const CellGrid grid(bounds_of(run));
      if (grid.is_divisible()) sort(run, grid, 3 * kBitsPerAxis);
    }
  }

  size_t max_run_;
  std::vector<Item> items_, moved_;
  std::vector<IndexedPoint> copy_;
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
  return key_of_cell<kDoubleStepsOfKey>(x, y, z);
}

void hilbert_order(std::span<const Eigen::Vector3f> positions, int64_t max_run,
                   std::span<IndexedPoint> ordered) {
  check(max_run >= 1, "hilbert_order: max_run >= 1");
  check(ordered.size() == positions.size(), "hilbert_order: room for every point");
  check_positions(positions);
  if (positions.empty()) return;
  CellGrid grid(bounds_of_most(positions));
  if (!grid.is_divisible()) grid = CellGrid(bounds_of(positions));
  const bool all_in_one_place = !grid.is_divisible();
  const std::vector<uint32_t> starts = distribute(
      positions.size(), kBuckets,
      [&](size_t i) { return all_in_one_place ? 0 : grid.bucket(array_of(positions[i])); },
      [&](size_t i, size_t place) {
        const Eigen::Vector3f& x = positions[i];
        ordered[place] = {x.x(), x.y(), x.z(), static_cast<uint32_t>(i)};
      });
  if (all_in_one_place) return;
  constexpr int kRestOfKey = 6 * (kDoubleStepsOfKey - kDoubleStepsOfBucket);
  const auto sort_bucket = [&](size_t b, RangeSorter& sorter) {
    sorter.sort(ordered.subspan(starts[b], starts[b + 1] - starts[b]), grid, kRestOfKey);
  };
  const auto is_large = [&](size_t b) { return starts[b + 1] - starts[b] > 4 * kGrain; };
  for (size_t b = 0; b < kBuckets; ++b) {
    if (!is_large(b)) continue;
    RangeSorter on_all_threads(max_run);
    sort_bucket(b, on_all_threads);
  }
  std::vector<RangeSorter> sorters(static_cast<size_t>(num_threads()), RangeSorter(max_run));
  parallel_for_workers(kBuckets, 1, [&](int64_t begin, int64_t, int worker) {
    const auto b = static_cast<size_t>(begin);
    if (!is_large(b)) sort_bucket(b, sorters[static_cast<size_t>(worker)]);
  });
}

}  // namespace vggtcd
