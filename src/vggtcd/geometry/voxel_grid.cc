// SPDX-License-Identifier: Apache-2.0
// Voxel grid by hashing, tables per thread: the best point of a voxel is a maximum, which does
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

// The ranks of the best points of 2 x 2 x 2 voxels, one cache line; 0: no point yet. Noise of depth
// moves neighbouring pixels between neighbouring voxels, so they meet in the same line.
struct alignas(64) Cube {
  uint64_t best[8] = {};
};
Voxel cube_of(const Voxel& v) { return {v.x >> 1, v.y >> 1, v.z >> 1}; }
size_t place_in_cube(const Voxel& v) {
  return static_cast<size_t>((v.x & 1) | (v.y & 1) << 1 | (v.z & 1) << 2);
}

// Number of the cube -> cube, by open addressing with linear probing, at most three quarters full.
class CubeTable {
 public:
  CubeTable() : slots_(zeroed(1 << 10)) {}

  void prefetch(const Voxel& number) const { __builtin_prefetch(&slots_[first_slot(number)]); }

  // The place in cubes() of this cube, which is made if it is new.
  size_t find_or_add(const Voxel& number) {
    if (4 * cubes_.size() >= 3 * slots_.size()) grow();
    Slot& slot = find(number);
    if (slot.cube == 0) {
      cubes_.emplace_back();
      slot = {number, static_cast<uint32_t>(cubes_.size())};
    }
    return slot.cube - 1;
  }

  std::vector<Cube>& cubes() { return cubes_; }

  // The cube of this number or nullptr.
  const Cube* find_cube(const Voxel& number) const {
    const Slot& slot = slots_[place_of(number)];
    return slot.cube == 0 ? nullptr : &cubes_[slot.cube - 1];
  }

  // Calls visit(number, cube) for every cube.
  template <typename Visit>
  void for_each(const Visit& visit) const {
    for (const Slot& slot : slots_) {
      if (slot.cube != 0) visit(slot.number, cubes_[slot.cube - 1]);
    }
  }

 private:
  struct Slot {
    Voxel number;
    uint32_t cube;  // 1 + its place in cubes_; 0: free
  };
  static LargeArray<Slot> zeroed(size_t size) {
    LargeArray<Slot> slots(size);
    std::ranges::fill(slots, Slot{});
    return slots;
  }
  size_t first_slot(const Voxel& number) const {
    // Odd constants spread each coordinate over the word; the product's upper half is well mixed.
    uint64_t bits = static_cast<uint32_t>(number.x) * 0x9E3779B97F4A7C15u;
    bits ^= static_cast<uint32_t>(number.y) * 0xC2B2AE3D27D4EB4Fu;
    bits ^= static_cast<uint32_t>(number.z) * 0x165667B19E3779F9u;
    bits = (bits ^ bits >> 29) * 0xBF58476D1CE4E5B9u;
    return static_cast<size_t>(bits >> 32) & (slots_.size() - 1);
  }
  // Where the slot of this number is, or the free one where it would be.
  size_t place_of(const Voxel& number) const {
    size_t i = first_slot(number);
    while (slots_[i].cube != 0 && slots_[i].number != number) i = (i + 1) & (slots_.size() - 1);
    return i;
  }
  Slot& find(const Voxel& number) { return slots_[place_of(number)]; }
  void grow() {
    const LargeArray<Slot> old = std::exchange(slots_, zeroed(2 * slots_.size()));
    for (const Slot& slot : old) {
      if (slot.cube != 0) find(slot.number) = slot;
    }
  }

  LargeArray<Slot> slots_;  // a power of two
  std::vector<Cube> cubes_;
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

// Enters points begin..end, at most kBatch of them. Table and cubes are larger than the caches, so
// their lines are asked for together, not one after the other.
void enter_batch(std::span<const Eigen::Vector3f> positions, std::span<const float> confidence,
                 double voxel_size, size_t begin, size_t end, CubeTable& table) {
  std::array<int32_t, 3 * kBatch> numbers;
  voxel_numbers({positions[begin].data(), 3 * (end - begin)}, voxel_size, numbers.data());
  // Points that follow one another in a cube.
  struct Run {
    Voxel cube;
    size_t begin, place;
  };
  std::array<Run, kBatch + 1> runs;
  size_t num_runs = 0;
  const auto voxel = [&](size_t i) {
    const int32_t* number = &numbers[3 * (i - begin)];
    return Voxel{number[0], number[1], number[2]};
  };
  for (size_t i = begin; i < end; ++i) {
    const Voxel cube = cube_of(voxel(i));
    if (num_runs > 0 && runs[num_runs - 1].cube == cube) continue;
    runs[num_runs++] = {cube, i, 0};
    table.prefetch(cube);
  }
  runs[num_runs].begin = end;
  for (size_t r = 0; r < num_runs; ++r) {
    runs[r].place = table.find_or_add(runs[r].cube);
    __builtin_prefetch(&table.cubes()[runs[r].place], 1);
  }
  for (size_t r = 0; r < num_runs; ++r) {
    Cube& cube = table.cubes()[runs[r].place];
    for (size_t i = runs[r].begin; i < runs[r + 1].begin; ++i) {
      uint64_t& best = cube.best[place_in_cube(voxel(i))];
      best = std::max(best, rank_of(confidence[i], static_cast<uint32_t>(i)));
    }
  }
}

// Enters what another table holds.
void enter(const CubeTable& other, CubeTable& table) {
  other.for_each([&](const Voxel& number, const Cube& from) {
    Cube& to = table.cubes()[table.find_or_add(number)];
    for (size_t i = 0; i < 8; ++i) to.best[i] = std::max(to.best[i], from.best[i]);
  });
}

// A grid of voxels that are either marked or not.
class MarkedVoxels {
 public:
  MarkedVoxels(std::span<const Eigen::Vector3f> positions, std::span<const uint32_t> members,
               double voxel_size)
      : voxel_size_(voxel_size) {
    for (const uint32_t i : members) {
      const Voxel voxel = voxel_of(positions[i]);
      table_.cubes()[table_.find_or_add(cube_of(voxel))].best[place_in_cube(voxel)] = 1;
    }
  }
  bool has(const Eigen::Vector3f& x) const {
    const Voxel voxel = voxel_of(x);
    const Cube* cube = table_.find_cube(cube_of(voxel));
    return cube != nullptr && cube->best[place_in_cube(voxel)] != 0;
  }

 private:
  Voxel voxel_of(const Eigen::Vector3f& x) const {
    std::array<int32_t, 3> numbers;
    voxel_numbers({x.data(), 3}, voxel_size_, numbers.data());
    return {numbers[0], numbers[1], numbers[2]};
  }

  double voxel_size_;
  CubeTable table_;
};

// The indices of the best points, in ascending order without sorting: one bit per point, then
// collected.
std::vector<uint32_t> best_points(std::span<const Cube> cubes, size_t num_points) {
  std::vector<uint64_t> is_best((num_points + 63) / 64, 0);
  size_t count = 0;
  for (const Cube& cube : cubes) {
    for (const uint64_t rank : cube.best) {
      if (rank == 0) continue;
      is_best[index_of(rank) / 64] |= uint64_t{1} << index_of(rank) % 64;
      ++count;
    }
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
  std::vector<CubeTable> tables(static_cast<size_t>(num_threads()));
  parallel_for_workers(
      static_cast<int64_t>(positions.size()), 1 << 16,
      [&](int64_t chunk_begin, int64_t chunk_end, int worker) {
        const size_t end = static_cast<size_t>(chunk_end);
        for (size_t begin = static_cast<size_t>(chunk_begin); begin < end; begin += kBatch) {
          enter_batch(positions, confidence, voxel_size, begin, std::min(end, begin + kBatch),
                      tables[static_cast<size_t>(worker)]);
        }
      });
  for (size_t worker = 1; worker < tables.size(); ++worker) enter(tables[worker], tables[0]);
  return best_points(tables[0].cubes(), positions.size());
}

std::vector<uint32_t> points_in_voxels_of(std::span<const Eigen::Vector3f> positions,
                                          std::span<const uint32_t> members, double voxel_size) {
  check(positions.size() < std::numeric_limits<uint32_t>::max(), "points_in_voxels_of: < 2^32");
  check(voxel_size > 0 && std::isfinite(voxel_size), "points_in_voxels_of: voxel_size > 0");
  if (members.empty()) return {};
  const MarkedVoxels marked(positions, members, voxel_size);
  constexpr int64_t kGrain = 1 << 16;
  const auto count = static_cast<int64_t>(positions.size());
  std::vector<std::vector<uint32_t>> of_chunk(static_cast<size_t>(num_chunks(count, kGrain)));
  parallel_for(count, kGrain, [&](int64_t begin, int64_t end) {
    std::vector<uint32_t>& found = of_chunk[static_cast<size_t>(begin / kGrain)];
    for (size_t i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
      if (marked.has(positions[i])) found.push_back(static_cast<uint32_t>(i));
    }
  });
  std::vector<uint32_t> result;
  for (const auto& found : of_chunk) result.insert(result.end(), found.begin(), found.end());
  return result;
}

}  // namespace vggtcd
