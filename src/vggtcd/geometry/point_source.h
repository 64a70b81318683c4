// SPDX-License-Identifier: Apache-2.0
// Points that are made when they are asked for: at full size an array of them would be the largest
// in memory.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "vggtcd/core/parallel.h"

namespace vggtcd {

class PointSource {
 public:
  virtual ~PointSource() = default;

  // Chunk k holds the points numbered starts()[k] .. starts()[k + 1]; the last entry is their
  // number.
  virtual std::span<const size_t> starts() const = 0;
  // The points of a chunk, in `memory` or elsewhere; the same at every call, from any thread.
  virtual std::span<const Eigen::Vector3f> chunk(size_t k,
                                                 std::vector<Eigen::Vector3f>& memory) const = 0;

  size_t size() const { return starts().back(); }
  size_t num_chunks() const { return starts().size() - 1; }

  // Calls visit(chunk, points of the chunk) for every chunk, in parallel.
  template <typename Visit>
  void for_each_chunk(const Visit& visit) const {
    std::vector<std::vector<Eigen::Vector3f>> memory(static_cast<size_t>(num_threads()));
    parallel_for_workers(static_cast<int64_t>(num_chunks()), 1,
                         [&](int64_t k, int64_t, int worker) {
                           const auto number = static_cast<size_t>(k);
                           visit(number, chunk(number, memory[static_cast<size_t>(worker)]));
                         });
  }
};

// Points that are there already.
class PointArray : public PointSource {
 public:
  explicit PointArray(std::span<const Eigen::Vector3f> points) : points_(points) {
    constexpr size_t kChunk = 1 << 16;
    for (size_t start = 0; start < points.size(); start += kChunk) starts_.push_back(start);
    starts_.push_back(points.size());
  }
  std::span<const size_t> starts() const override { return starts_; }
  std::span<const Eigen::Vector3f> chunk(size_t k, std::vector<Eigen::Vector3f>&) const override {
    return points_.subspan(starts_[k], starts_[k + 1] - starts_[k]);
  }

 private:
  std::span<const Eigen::Vector3f> points_;
  std::vector<size_t> starts_;
};

}  // namespace vggtcd
