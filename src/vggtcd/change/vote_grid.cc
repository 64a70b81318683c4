// SPDX-License-Identifier: Apache-2.0
// VoteGrid: sums of votes per voxel, filled from many threads with the same result on any number.
#include "vggtcd/change/vote_grid.h"

#include <cmath>

namespace vggtcd {
namespace {

constexpr uint64_t kSlots = uint64_t{1} << 21;
constexpr uint64_t kMaxUsed = kSlots / 4 * 3;
constexpr int64_t kHalfRange = int64_t{1} << 20;  // 21 bits per axis

uint64_t slot_of(uint64_t key) {
  key ^= key >> 31;
  key *= 0x9e3779b97f4a7c15u;
  return (key >> 40) & (kSlots - 1);
}

}  // namespace

VoteGrid::VoteGrid(double voxel_size) : voxel_size_(voxel_size), slots_(kSlots) {}

std::optional<uint64_t> VoteGrid::key_of(const Eigen::Vector3f& position) const {
  uint64_t key = 0;
  for (int axis = 0; axis < 3; ++axis) {
    const double cell = std::floor(static_cast<double>(position[axis]) / voxel_size_);
    // Strays far outside the scene vote for themselves alone.
    if (!(std::abs(cell) < static_cast<double>(kHalfRange))) return {};
    key = (key << 21) | static_cast<uint64_t>(static_cast<int64_t>(cell) + kHalfRange);
  }
  return key + 1;  // 0 means free
}

bool VoteGrid::add(const Eigen::Vector3f& position, const Votes& votes) {
  const auto key = key_of(position);
  if (!key) return true;
  for (uint64_t i = slot_of(*key);; i = (i + 1) & (kSlots - 1)) {
    Slot& slot = slots_[i];
    uint64_t found = slot.key.load(std::memory_order_relaxed);
    if (found == 0) {
      if (used_.load(std::memory_order_relaxed) >= kMaxUsed) return false;
      if (slot.key.compare_exchange_strong(found, *key, std::memory_order_relaxed)) {
        used_.fetch_add(1, std::memory_order_relaxed);
        found = *key;
      }
    }
    if (found != *key) continue;
    slot.points.fetch_add(votes.points, std::memory_order_relaxed);
    slot.count.fetch_add(votes.count, std::memory_order_relaxed);
    slot.weight.fetch_add(votes.weight, std::memory_order_relaxed);
    slot.through.fetch_add(votes.through, std::memory_order_relaxed);
    slot.gap.fetch_add(votes.gap, std::memory_order_relaxed);
    slot.evidence.fetch_add(votes.evidence, std::memory_order_relaxed);
    slot.sigma.fetch_add(votes.sigma, std::memory_order_relaxed);
    return true;
  }
}

Votes VoteGrid::at(const Eigen::Vector3f& position) const {
  const auto key = key_of(position);
  if (!key) return {};
  for (uint64_t i = slot_of(*key);; i = (i + 1) & (kSlots - 1)) {
    const Slot& slot = slots_[i];
    const uint64_t found = slot.key.load(std::memory_order_relaxed);
    if (found == 0) return {};
    if (found != *key) continue;
    return {
        slot.points.load(std::memory_order_relaxed), slot.count.load(std::memory_order_relaxed),
        slot.weight.load(std::memory_order_relaxed), slot.through.load(std::memory_order_relaxed),
        slot.gap.load(std::memory_order_relaxed),    slot.evidence.load(std::memory_order_relaxed),
        slot.sigma.load(std::memory_order_relaxed)};
  }
}

}  // namespace vggtcd
