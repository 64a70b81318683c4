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

  void include(const Eigen::Array3f& x) {
    low = low.min(x);
    high = high.max(x);
  }
  void include(const Bounds& other) {
    low = low.min(other.low);
    high = high.max(other.high);
  }
};

Eigen::Array3f array_of(const IndexedPoint& p) { return {p.x, p.y, p.z}; }

constexpr int64_t kGrain = 1 << 16;

Bounds bounds_of(std::span<const IndexedPoint> points) {
  const auto size = static_cast<int64_t>(points.size());
  std::vector<Bounds> partial(static_cast<size_t>(num_chunks(size, kGrain)));
  parallel_for(size, kGrain, [&](int64_t begin, int64_t end) {
    Bounds& bounds = partial[static_cast<size_t>(begin / kGrain)];
    for (int64_t i = begin; i < end; ++i) bounds.include(array_of(points[static_cast<size_t>(i)]));
  });
  Bounds all;
  for (const Bounds& bounds : partial) all.include(bounds);
  return all;
}

// A first look at all points: checks them.
struct Survey {
  Bounds all;
  std::vector<Eigen::Vector3f> sample;  // every so many-th

  explicit Survey(const PointSource& points) {
    constexpr size_t kSample = 4096;
    const size_t stride = std::max<size_t>(1, points.size() / kSample);
    std::vector<Survey> partial(points.num_chunks());
    points.for_each_chunk([&](size_t k, std::span<const Eigen::Vector3f> chunk) {
      bool valid = true;
      for (const Eigen::Vector3f& x : chunk) {
        valid &= (x.array().abs() < 1e18f).all();  // false for NaN
        partial[k].all.include(x.array());
      }
      check(valid, "hilbert_order: finite positions below 1e18");
      const size_t start = points.starts()[k];
      for (size_t i = (stride - start % stride) % stride; i < chunk.size(); i += stride) {
        partial[k].sample.push_back(chunk[i]);
      }
    });
    for (const Survey& part : partial) {
      all.include(part.all);
      sample.insert(sample.end(), part.sample.begin(), part.sample.end());
    }
  }
  Survey() = default;

  // The box of most points, by the 2nd and 98th percentile of the sample, with a margin. What it
  // leaves out costs a little order at its border; a box of all points could be mostly empty.
  Bounds of_most() const {
    Bounds bounds;
    std::vector<float> values(sample.size());
    for (int axis = 0; axis < 3; ++axis) {
      for (size_t i = 0; i < sample.size(); ++i) values[i] = sample[i][axis];
      std::ranges::sort(values);
      const size_t outside = values.size() / 50;
      const float low = values[outside], high = values[values.size() - 1 - outside];
      bounds.low[axis] = low - (high - low) / 4;
      bounds.high[axis] = high + (high - low) / 4;
    }
    return bounds;
  }
};

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

// Stable counting sort on all threads. each_chunk(visit) calls visit(chunk, its elements) for all
// chunks; an element goes to the bucket bucket_of(element) < buckets by move(element, chunk, number
// in the chunk, place). Returns where each bucket starts, and the end.
template <typename EachChunk, typename BucketOf, typename Move>
std::vector<uint32_t> distribute(size_t chunks, size_t buckets, const EachChunk& each_chunk,
                                 const BucketOf& bucket_of, const Move& move) {
  std::vector<uint32_t> next(chunks * buckets, 0);
  each_chunk([&](size_t chunk, const auto& elements) {
    uint32_t* counts = next.data() + chunk * buckets;
    for (const auto& element : elements) ++counts[bucket_of(element)];
  });
  std::vector<uint32_t> starts(buckets + 1);
  uint32_t start = 0;
  for (size_t bucket = 0; bucket < buckets; ++bucket) {
    starts[bucket] = start;
    for (size_t i = bucket; i < next.size(); i += buckets) start += std::exchange(next[i], start);
  }
  starts.back() = start;
  each_chunk([&](size_t chunk, const auto& elements) {
    uint32_t* places = next.data() + chunk * buckets;
    for (size_t i = 0; i < elements.size(); ++i) {
      move(elements[i], chunk, i, places[bucket_of(elements[i])]++);
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
      const auto size = static_cast<int64_t>(items_.size());
      distribute(
          static_cast<size_t>(num_chunks(size, kGrain)), size_t{1} << kDigitBits,
          [&](const auto& visit) {
            parallel_for(size, kGrain, [&](int64_t begin, int64_t end) {
              visit(static_cast<size_t>(begin / kGrain),
                    std::span(items_).subspan(static_cast<size_t>(begin),
                                              static_cast<size_t>(end - begin)));
            });
          },
          [&](Item item) { return item >> shift & ((1u << kDigitBits) - 1); },
          [&](Item item, size_t, size_t, size_t place) { moved_[place] = item; });
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

}  // namespace

uint32_t hilbert_key(uint32_t x, uint32_t y, uint32_t z) {
  check(std::max({x, y, z}) < 1u << kBitsPerAxis, "hilbert_key: coordinates below 1024");
  return key_of_cell<kDoubleStepsOfKey>(x, y, z);
}

void hilbert_order(const PointSource& points, int64_t max_run, std::span<IndexedPoint> ordered) {
  check(max_run >= 1, "hilbert_order: max_run >= 1");
  check(points.size() <= std::numeric_limits<int32_t>::max(), "hilbert_order: < 2^31 points");
  check(ordered.size() == points.size(), "hilbert_order: room for every point");
  if (ordered.empty()) return;
  const Survey survey(points);
  CellGrid grid(survey.of_most());
  if (!grid.is_divisible()) grid = CellGrid(survey.all);
  const bool all_in_one_place = !grid.is_divisible();
  const std::vector<uint32_t> starts = distribute(
      points.num_chunks(), kBuckets, [&](const auto& visit) { points.for_each_chunk(visit); },
      [&](const Eigen::Vector3f& x) { return all_in_one_place ? 0 : grid.bucket(x.array()); },
      [&](const Eigen::Vector3f& x, size_t chunk, size_t i, size_t place) {
        ordered[place] = {x.x(), x.y(), x.z(), static_cast<uint32_t>(points.starts()[chunk] + i)};
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
