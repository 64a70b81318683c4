// SPDX-License-Identifier: Apache-2.0
// Voxel grid by hashing, one table per thread: the best point of a voxel is a maximum, which does
// not depend on the order in which points are looked at.
#include "vggtcd/geometry/voxel_grid.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "vggtcd/core/error.h"
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

// Voxel -> highest rank, by open addressing with linear probing, at most half full.
class VoxelTable {
 public:
  struct Slot {
    Voxel voxel;
    uint64_t rank;  // 0: free
  };

  VoxelTable() : slots_(1024) {}

  // The rank of this voxel, 0 if it is new, to be raised by the caller. Valid until the next call.
  uint64_t& operator[](const Voxel& voxel) {
    if (2 * used_ >= slots_.size()) grow();
    Slot& slot = find(voxel);
    if (slot.rank == 0) {
      slot.voxel = voxel;
      ++used_;
    }
    return slot.rank;
  }

  template <typename F>
  void for_each(F&& visit) const {
    for (const Slot& slot : slots_) {
      if (slot.rank != 0) visit(slot.voxel, slot.rank);
    }
  }

 private:
  static size_t hash(const Voxel& voxel) {
    // Odd constants spread each coordinate over the word; the upper half of the product is well
    // mixed.
    uint64_t bits = static_cast<uint32_t>(voxel.x) * 0x9E3779B97F4A7C15u;
    bits ^= static_cast<uint32_t>(voxel.y) * 0xC2B2AE3D27D4EB4Fu;
    bits ^= static_cast<uint32_t>(voxel.z) * 0x165667B19E3779F9u;
    return static_cast<size_t>((bits ^ bits >> 29) * 0xBF58476D1CE4E5B9u >> 32);
  }
  Slot& find(const Voxel& voxel) {
    const size_t mask = slots_.size() - 1;
    size_t i = hash(voxel) & mask;
    while (slots_[i].rank != 0 && slots_[i].voxel != voxel) i = (i + 1) & mask;
    return slots_[i];
  }
  void grow() {
    std::vector<Slot> old(2 * slots_.size());
    old.swap(slots_);
    for (const Slot& slot : old) {
      if (slot.rank != 0) find(slot.voxel) = slot;
    }
  }

  std::vector<Slot> slots_;  // a power of two
  size_t used_ = 0;
};

int32_t voxel_number(float coordinate, double voxel_size) {
  const double number = std::floor(static_cast<double>(coordinate) / voxel_size);
  if (!(std::abs(number) < 2147483648.0)) {
    throw_error(ErrorCode::kDegenerate,
                "voxel grid: expected a voxel size above 2^-31 of the coordinates, found {} for "
                "coordinate {}; choose a coarser grid",
                voxel_size, coordinate);
  }
  return static_cast<int32_t>(number);
}

// Enters points begin..end. Pixels next to one another mostly share a voxel: it is looked up once
// for the run.
void enter(std::span<const Eigen::Vector3f> positions, std::span<const float> confidence,
           double voxel_size, size_t begin, size_t end, VoxelTable& table) {
  const auto voxel_of = [&](const Eigen::Vector3f& x) {
    return Voxel{voxel_number(x.x(), voxel_size), voxel_number(x.y(), voxel_size),
                 voxel_number(x.z(), voxel_size)};
  };
  Voxel voxel = voxel_of(positions[begin]);
  uint64_t best = 0;
  const auto enter_run = [&] {
    uint64_t& rank = table[voxel];
    rank = std::max(rank, best);
  };
  for (size_t i = begin; i < end; ++i) {
    if (const Voxel next = voxel_of(positions[i]); next != voxel) {
      enter_run();
      voxel = next;
      best = 0;
    }
    best = std::max(best, rank_of(confidence[i], static_cast<uint32_t>(i)));
  }
  enter_run();
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
  for (size_t worker = 1; worker < tables.size(); ++worker) {
    tables[worker].for_each([&](const Voxel& voxel, uint64_t other) {
      uint64_t& rank = tables[0][voxel];
      rank = std::max(rank, other);
    });
  }
  std::vector<uint32_t> kept;
  tables[0].for_each([&](const Voxel&, uint64_t rank) { kept.push_back(index_of(rank)); });
  std::sort(kept.begin(), kept.end());
  return kept;
}

}  // namespace vggtcd
