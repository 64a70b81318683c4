// SPDX-License-Identifier: Apache-2.0
// VoteGrid: sums of votes per voxel, filled from many threads with the same result on any number.
#pragma once

#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <optional>
#include <vector>

namespace vggtcd {

// Sums over votes. Those from `through` on are weighted by `weight`, in fixed point.
struct Votes {
  uint32_t points = 0;  // that asked
  uint32_t count = 0;   // photos that could tell, summed over the points
  int64_t weight = 0;
  int64_t through = 0;   // weight of those that look through
  int64_t gap = 0;       // signed gaps
  int64_t evidence = 0;  // the same in sigmas
  int64_t sigma = 0;     // sigmas of the gaps
};

// An open-addressing table of atomics. All sums are of integers, so their order does not matter.
class VoteGrid {
 public:
  explicit VoteGrid(double voxel_size);

  // False if the table is too full: the caller starts again with larger voxels. Whether that
  // happens depends on the set of voxels, not on the order of the calls.
  bool add(const Eigen::Vector3f& position, const Votes& votes);

  // Zeros for a voxel nobody voted in.
  Votes at(const Eigen::Vector3f& position) const;

  double voxel_size() const { return voxel_size_; }

 private:
  struct Slot {
    std::atomic<uint64_t> key{0};  // 0: free
    std::atomic<uint32_t> points{0}, count{0};
    std::atomic<int64_t> weight{0}, through{0}, gap{0}, evidence{0}, sigma{0};
  };
  std::optional<uint64_t> key_of(const Eigen::Vector3f& position) const;

  double voxel_size_;
  std::vector<Slot> slots_;
  std::atomic<uint64_t> used_{0};
};

}  // namespace vggtcd
