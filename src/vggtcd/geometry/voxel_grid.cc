// SPDX-License-Identifier: Apache-2.0
// Voxel grid by hashing, one table per thread: the best point of a voxel is a maximum, which does
// not depend on the order in which points are looked at.
#include "vggtcd/geometry/voxel_grid.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "vggtcd/core/error.h"
#include "vggtcd/core/large_array.h"
#include "vggtcd/core/parallel.h"

namespace vggtcd {
namespace {

struct Voxel {
  int32_t x, y, z;
  bool operator==(const Voxel&) const = default;
};

// A point as a number: the larger, the more confident; of equals the lower the index. Never 0.
uint64_t rank_of(float confidence, uint32_t index) {
  const uint32_t bits = std::bit_cast<uint32_t>(confidence + 0.0f);  // -0 becomes +0
  const uint32_t ascending = (bits >> 31) != 0 ? ~bits : bits | 0x80000000u;
  return uint64_t{ascending} << 32 | (std::numeric_limits<uint32_t>::max() - index);
}
uint32_t index_of(uint64_t rank) {
  return std::numeric_limits<uint32_t>::max() - static_cast<uint32_t>(rank);
}

// What a table holds of a voxel: the rank of its best point. 0: free slot.
struct Slot {
  Voxel voxel;
  uint64_t rank;
};

// Voxel -> highest rank, by open addressing with linear probing, at most three quarters full.
class VoxelTable {
 public:
  VoxelTable() : slots_(zeroed(1 << 10)) {}

  // Enters voxels. The table is larger than the caches and its slots are looked up all over the
  // place, so their cache lines are asked for together, not one after the other.
  void raise(std::span<const Slot> entries) {
    for (const Slot& entry : entries) __builtin_prefetch(&slots_[first_slot(entry.voxel)]);
    for (const Slot& entry : entries) {
      if (4 * used_ >= 3 * slots_.size()) grow();
      Slot& slot = find(entry.voxel);
      if (slot.rank == 0) {
        slot = entry;
        ++used_;
      } else {
        slot.rank = std::max(slot.rank, entry.rank);
      }
    }
  }

  std::span<const Slot> slots() const { return slots_; }

 private:
  static LargeArray<Slot> zeroed(size_t size) {
    LargeArray<Slot> slots(size);
    std::ranges::fill(slots, Slot{});
    return slots;
  }
  size_t first_slot(const Voxel& voxel) const {
    // Odd constants spread each coordinate over the word; the product's upper half is well mixed.
    uint64_t bits = static_cast<uint32_t>(voxel.x) * 0x9E3779B97F4A7C15u;
    bits ^= static_cast<uint32_t>(voxel.y) * 0xC2B2AE3D27D4EB4Fu;
    bits ^= static_cast<uint32_t>(voxel.z) * 0x165667B19E3779F9u;
    bits = (bits ^ bits >> 29) * 0xBF58476D1CE4E5B9u;
    return static_cast<size_t>(bits >> 32) & (slots_.size() - 1);
  }
  Slot& find(const Voxel& voxel) {
    size_t i = first_slot(voxel);
    while (slots_[i].rank != 0 && slots_[i].voxel != voxel) i = (i + 1) & (slots_.size() - 1);
    return slots_[i];
  }
  void grow() {
    const LargeArray<Slot> old = std::exchange(slots_, zeroed(2 * slots_.size()));
    for (const Slot& slot : old) {
      if (slot.rank != 0) find(slot.voxel) = slot;
    }
  }

  LargeArray<Slot> slots_;  // a power of two
  size_t used_ = 0;
};

constexpr size_t kBatch = 256;  // points that are looked at together

void check_not_too_fine(std::span<const float> coordinates, double voxel_size) {
  int32_t largest = 0;  // of the bits of the magnitudes, which ascend like them; NaN is on top
  for (const float x : coordinates) {
    largest = std::max(largest, std::bit_cast<int32_t>(x) & 0x7FFFFFFF);
  }
  const float magnitude = std::bit_cast<float>(largest);
  if (!(static_cast<double>(magnitude) / voxel_size < 2147483648.0)) {
    throw_error(ErrorCode::kDegenerate,
                "voxel grid: expected a voxel size above 2^-31 of the coordinates, found {} for "
                "coordinate {}; choose a coarser grid",
                voxel_size, magnitude);
  }
}

// floor(coordinate / voxel_size) of all coordinates, written so that the compiler divides two or
// more at a time; std::floor is a function call on plain x86-64.
void voxel_numbers(std::span<const float> coordinates, double voxel_size, int32_t* numbers) {
  check_not_too_fine(coordinates, voxel_size);
  for (size_t i = 0; i < coordinates.size(); ++i) {
    const double number = static_cast<double>(coordinates[i]) / voxel_size;
    const auto truncated = static_cast<int32_t>(number);
    numbers[i] = truncated - static_cast<int32_t>(static_cast<double>(truncated) > number);
  }
}

// Enters points begin..end. Pixels next to one another often share a voxel and are entered as one.
void enter(std::span<const Eigen::Vector3f> positions, std::span<const float> confidence,
           double voxel_size, size_t begin, size_t end, VoxelTable& table) {
  std::array<int32_t, 3 * kBatch> numbers;
  std::array<Slot, kBatch> runs;
  for (; begin < end; begin += kBatch) {
    const size_t count = std::min(kBatch, end - begin);
    voxel_numbers({positions[begin].data(), 3 * count}, voxel_size, numbers.data());
    size_t num_runs = 0;
    for (size_t i = 0; i < count; ++i) {
      const Voxel voxel{numbers[3 * i], numbers[3 * i + 1], numbers[3 * i + 2]};
      const uint64_t rank = rank_of(confidence[begin + i], static_cast<uint32_t>(begin + i));
      if (num_runs > 0 && runs[num_runs - 1].voxel == voxel) {
        runs[num_runs - 1].rank = std::max(runs[num_runs - 1].rank, rank);
      } else {
        runs[num_runs++] = {voxel, rank};
      }
    }
    table.raise(std::span(runs).first(num_runs));
  }
}

// Enters what another table holds.
void enter(const VoxelTable& other, VoxelTable& table) {
  std::array<Slot, kBatch> entries;
  size_t count = 0;
  for (const Slot& slot : other.slots()) {
    if (slot.rank == 0) continue;
    entries[count++] = slot;
    if (count == kBatch) table.raise(std::span(entries).first(std::exchange(count, 0)));
  }
  table.raise(std::span(entries).first(count));
}

// The indices of the best points, in ascending order without sorting: one bit per point, then
// collected.
std::vector<uint32_t> best_points(const VoxelTable& table, size_t num_points) {
  std::vector<uint64_t> is_best((num_points + 63) / 64, 0);
  size_t count = 0;
  for (const Slot& slot : table.slots()) {
    if (slot.rank == 0) continue;
    const uint32_t index = index_of(slot.rank);
    is_best[index / 64] |= uint64_t{1} << index % 64;
    ++count;
  }
  std::vector<uint32_t> best;
  best.reserve(count);
  for (size_t word = 0; word < is_best.size(); ++word) {
    for (uint64_t bits = is_best[word]; bits != 0; bits &= bits - 1) {
      best.push_back(static_cast<uint32_t>(64 * word) +
                     static_cast<uint32_t>(std::countr_zero(bits)));
    }
  }
  return best;
}

}  // namespace

std::vector<uint32_t> voxel_downsample(std::span<const Eigen::Vector3f> positions,
                                       std::span<const float> confidence, double voxel_size) {
  check(positions.size() == confidence.size(), "voxel_downsample: one confidence per position");
  check(positions.size() < std::numeric_limits<uint32_t>::max(), "voxel_downsample: < 2^32 points");
  check(voxel_size > 0 && std::isfinite(voxel_size), "voxel_downsample: voxel_size > 0");
  std::vector<VoxelTable> tables(static_cast<size_t>(num_threads()));
  parallel_for_workers(static_cast<int64_t>(positions.size()), 1 << 16,
                       [&](int64_t begin, int64_t end, int worker) {
                         enter(positions, confidence, voxel_size, static_cast<size_t>(begin),
                               static_cast<size_t>(end), tables[static_cast<size_t>(worker)]);
                       });
  for (size_t worker = 1; worker < tables.size(); ++worker) enter(tables[worker], tables[0]);
  return best_points(tables[0], positions.size());
}

}  // namespace vggtcd
