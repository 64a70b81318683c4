// SPDX-License-Identifier: Apache-2.0
// VoteGrid: sums of votes per voxel, filled from many threads with the same result on any number.
#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <optional>
#include <vector>

namespace vggtcd {

struct Votes {
  uint32_t points = 0;   // that voted
  uint32_t votes = 0;    // photos that could tell, summed over the points
  uint32_t through = 0;  // of them that look through
  int64_t gap_sum = 0;   // of the signed gaps of all votes, fixed point
};

// An open-addressing table of atomics. All sums are of integers, so their order does not matter.
class VoteGrid {
 public:
  explicit VoteGrid(double voxel_size);

  // False if the table is too full: the caller starts again with larger voxels. Whether that
  // happens depends on the set of voxels, not on the order of the calls.
  bool add(const Eigen::Vector3f& position, uint32_t votes, uint32_t through, int64_t gap_sum);

  // Zeros for a voxel nobody voted in.
  Votes at(const Eigen::Vector3f& position) const;

  double voxel_size() const { return voxel_size_; }

 private:
  struct Slot {
    std::atomic<uint64_t> key{0};  // 0: free
    std::atomic<uint32_t> points{0}, votes{0}, through{0};
    std::atomic<int64_t> gap_sum{0};
  };
  std::optional<uint64_t> key_of(const Eigen::Vector3f& position) const;

  double voxel_size_;
  std::vector<Slot> slots_;
  std::atomic<uint64_t> used_{0};
};

}  // namespace vggtcd
