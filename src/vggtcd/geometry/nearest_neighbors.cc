// SPDX-License-Identifier: Apache-2.0
// Nearest neighbours: both clouds in Hilbert order, a tree of boxes over the targets, and packets
// of 16 queries that search it together (nearest_neighbors_kernel.h).
#include "vggtcd/geometry/nearest_neighbors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "vggtcd/core/cpu_features.h"
#include "vggtcd/core/error.h"
#include "vggtcd/core/large_array.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/geometry/hilbert_order.h"
#include "vggtcd/geometry/nearest_neighbors_tree.h"

namespace vggtcd {
namespace {

constexpr size_t kLanes = kNearestNeighborLanes;
constexpr float kInfinity = std::numeric_limits<float>::infinity();

// Sixteen points as they come from hilbert_order, in the place where the block will be.
using PointsOfBlock = std::array<IndexedPoint, kLanes>;
static_assert(sizeof(PointsOfBlock) == sizeof(PointBlock));

// Squares of distances fit into a float only for scenes of ordinary size. Others are searched
// scaled by a power of two, which changes no digit.
constexpr int kOrdinaryExponent = 40;
constexpr int kLargestExponent = 126;  // 2^e and 2^-e are normal floats

// The power of two that brings the coordinates of most points near 1; 0 where their size is
// ordinary. By the median of a sample, which a stray does not decide.
int exponent_of_scale(const PointSource& points) {
  constexpr size_t kChunks = 4, kPointsOfAChunk = 256;
  std::vector<float> sizes;
  std::vector<Eigen::Vector3f> memory;
  for (size_t c = 0; c < std::min(kChunks, points.num_chunks()); ++c) {
    const auto chunk = points.chunk(c * points.num_chunks() / kChunks, memory);
    const size_t stride = std::max<size_t>(1, chunk.size() / kPointsOfAChunk);
    for (size_t i = 0; i < chunk.size(); i += stride) {
      const float size = chunk[i].cwiseAbs().maxCoeff();
      if (size > 0 && std::isfinite(size)) sizes.push_back(size);
    }
  }
  if (sizes.empty()) return 0;
  std::ranges::nth_element(sizes, sizes.begin() + std::ssize(sizes) / 2);
  const int exponent = std::ilogb(sizes[sizes.size() / 2]);
  if (std::abs(exponent) <= kOrdinaryExponent) return 0;
  return std::clamp(-exponent, -kLargestExponent, kLargestExponent);
}

// Points times a power of two.
class ScaledPoints : public PointSource {
 public:
  ScaledPoints(const PointSource& points, int exponent)
      : points_(points), factor_(std::ldexp(1.0f, exponent)) {}
  std::span<const size_t> starts() const override { return points_.starts(); }
  std::span<const Eigen::Vector3f> chunk(size_t k,
                                         std::vector<Eigen::Vector3f>& memory) const override {
    const auto unscaled = points_.chunk(k, memory);
    if (factor_ == 1) return unscaled;
    if (unscaled.data() != memory.data()) memory.assign(unscaled.begin(), unscaled.end());
    for (size_t i = 0; i < unscaled.size(); ++i) memory[i] *= factor_;
    return std::span(memory).first(unscaled.size());
  }

 private:
  const PointSource& points_;
  float factor_;
};

LargeArray<PointBlock> make_blocks(const PointSource& points) {
  LargeArray<PointBlock> blocks((points.size() + kLanes - 1) / kLanes);
  if (blocks.empty()) return blocks;
  // One array serves both: at full size the points are the largest thing in memory.
  const std::span in_order(reinterpret_cast<IndexedPoint*>(blocks.data()), kLanes * blocks.size());
  hilbert_order(points, kNearestNeighborLanes, in_order.first(points.size()));
  std::ranges::fill(in_order.subspan(points.size()), in_order[points.size() - 1]);
  parallel_for(static_cast<int64_t>(blocks.size()), 1024, [&](int64_t begin, int64_t end) {
    for (size_t b = static_cast<size_t>(begin); b < static_cast<size_t>(end); ++b) {
      PointsOfBlock of_block;
      std::memcpy(&of_block, &blocks[b], sizeof(PointBlock));
      PointBlock block;
      for (size_t lane = 0; lane < kLanes; ++lane) {
        block.x[lane] = of_block[lane].x;
        block.y[lane] = of_block[lane].y;
        block.z[lane] = of_block[lane].z;
        block.index[lane] = static_cast<int32_t>(of_block[lane].index);
      }
      blocks[b] = block;
    }
  });
  return blocks;
}

float least(const float* values) {
  float result = values[0];
  for (size_t i = 1; i < kLanes; ++i) result = values[i] < result ? values[i] : result;
  return result;
}
float largest(const float* values) {
  float result = values[0];
  for (size_t i = 1; i < kLanes; ++i) result = values[i] > result ? values[i] : result;
  return result;
}

// Child c of a node, from the block or the node that it is.
void set_child(BoxNode& node, size_t c, const PointBlock& block) {
  const float* coordinates[3] = {block.x, block.y, block.z};
  for (int axis = 0; axis < 3; ++axis) {
    node.low[axis][c] = least(coordinates[axis]);
    node.high[axis][c] = largest(coordinates[axis]);
  }
  node.min_index[c] = *std::min_element(block.index, block.index + kLanes);
}

void set_child(BoxNode& node, size_t c, const BoxNode& child) {
  for (int axis = 0; axis < 3; ++axis) {
    node.low[axis][c] = least(child.low[axis]);
    node.high[axis][c] = largest(child.high[axis]);
  }
  node.min_index[c] = *std::min_element(child.min_index, child.min_index + kLanes);
}

template <typename Child>
LargeArray<BoxNode> make_level(const LargeArray<Child>& children) {
  LargeArray<BoxNode> nodes((children.size() + kLanes - 1) / kLanes);
  parallel_for(static_cast<int64_t>(nodes.size()), 256, [&](int64_t begin, int64_t end) {
    for (size_t n = static_cast<size_t>(begin); n < static_cast<size_t>(end); ++n) {
      std::fill_n(&nodes[n].low[0][0], 3 * kLanes, kInfinity);
      std::fill_n(&nodes[n].high[0][0], 3 * kLanes, -kInfinity);
      std::fill_n(nodes[n].min_index, kLanes, std::numeric_limits<int32_t>::max());
      const size_t first = n * kLanes, count = std::min(kLanes, children.size() - first);
      for (size_t c = 0; c < count; ++c) set_child(nodes[n], c, children[first + c]);
    }
  });
  return nodes;
}

LargeArray<PointBlock> scaled(const LargeArray<PointBlock>& blocks, int exponent) {
  LargeArray<PointBlock> result(blocks.size());
  parallel_for(static_cast<int64_t>(blocks.size()), 1024, [&](int64_t begin, int64_t end) {
    for (size_t b = static_cast<size_t>(begin); b < static_cast<size_t>(end); ++b) {
      result[b] = blocks[b];
      for (float* axis : {result[b].x, result[b].y, result[b].z}) {
        for (size_t lane = 0; lane < kLanes; ++lane) axis[lane] = std::ldexp(axis[lane], exponent);
      }
    }
  });
  return result;
}

// The least float whose root is above the bound, so that "less" on squares means "within the
// bound".
float squared_limit(float bound) {
  float limit = bound * bound;
  if (!(limit < std::numeric_limits<float>::max())) return std::numeric_limits<float>::max();
  while (std::sqrt(limit) <= bound) limit = std::nextafter(limit, kInfinity);
  return limit;
}

using Kernel = void (*)(const NearestNeighborTree&, const NearestNeighborQuery&);

Kernel kernel_for_this_processor() {
  switch (cpu_level()) {
    case CpuLevel::kReference:
      return nearest_neighbors_reference;
    case CpuLevel::kAvx2:
      return nearest_neighbors_avx2;
    case CpuLevel::kAvx512:
    case CpuLevel::kAvx512Bf16:
      return nearest_neighbors_avx512;
  }
  check(false, "nearest neighbors: unknown CpuLevel");
  return nullptr;
}

}  // namespace

struct NearestNeighborIndex::Impl {
  size_t size = 0;
  int exponent = 0;  // blocks and levels are times 2^exponent
  LargeArray<PointBlock> blocks;
  std::vector<LargeArray<BoxNode>> levels;

  explicit Impl(const PointSource& targets)
      : size(targets.size()),
        exponent(exponent_of_scale(targets)),
        blocks(make_blocks(ScaledPoints(targets, exponent))) {
    if (blocks.empty()) return;
    levels.push_back(make_level(blocks));
    while (levels.back().size() > 1) levels.push_back(make_level(levels.back()));
    check(levels.size() <= kMaxTreeLevels, "nearest neighbors: tree too high");
  }

  // Queries are scaled as the targets are, the bound and the distances are not.
  void query(const LargeArray<PointBlock>& queries, float bound, std::span<float> distance,
             std::span<int32_t> index) const {
    if (exponent == 0) return query_scaled(queries, bound, distance, index);
    const float scaled_bound = std::ldexp(bound, exponent);
    query_scaled(queries, scaled_bound, distance, index);
    for (float& d : distance) d = d < scaled_bound ? std::ldexp(d, -exponent) : bound;
  }

  void query_scaled(const LargeArray<PointBlock>& queries, float bound, std::span<float> distance,
                    std::span<int32_t> index) const {
    check(bound >= 0, "nearest neighbors: bound >= 0");
    check(index.empty() || index.size() == distance.size(),
          "nearest neighbors: one index per query or none");
    if (blocks.empty()) {
      std::fill(distance.begin(), distance.end(), bound);
      std::fill(index.begin(), index.end(), -1);
      return;
    }
    NearestNeighborTree tree{blocks.data(), {}, static_cast<int>(levels.size())};
    for (size_t level = 0; level < levels.size(); ++level)
      tree.levels[level] = levels[level].data();
    const float limit = squared_limit(bound);
    const Kernel kernel = kernel_for_this_processor();
    parallel_for(static_cast<int64_t>(queries.size()), 512, [&](int64_t begin, int64_t end) {
      kernel(tree, {queries.data() + begin, end - begin, bound, limit, distance.data(),
                    index.empty() ? nullptr : index.data()});
    });
  }
};

NearestNeighborIndex::NearestNeighborIndex(std::span<const Eigen::Vector3f> targets)
    : NearestNeighborIndex(PointArray(targets)) {}
NearestNeighborIndex::NearestNeighborIndex(const PointSource& targets)
    : impl_(std::make_unique<const Impl>(targets)) {}
NearestNeighborIndex::~NearestNeighborIndex() = default;
NearestNeighborIndex::NearestNeighborIndex(NearestNeighborIndex&&) noexcept = default;
NearestNeighborIndex& NearestNeighborIndex::operator=(NearestNeighborIndex&&) noexcept = default;

size_t NearestNeighborIndex::size() const { return impl_->size; }

void NearestNeighborIndex::query(std::span<const Eigen::Vector3f> queries, float bound,
                                 std::span<float> distance, std::span<int32_t> index) const {
  check(distance.size() == queries.size(), "nearest neighbors: one distance per query");
  const PointArray points(queries);
  impl_->query(make_blocks(ScaledPoints(points, impl_->exponent)), bound, distance, index);
}

void NearestNeighborIndex::query(const NearestNeighborIndex& queries, float bound,
                                 std::span<float> distance, std::span<int32_t> index) const {
  check(distance.size() == queries.size(), "nearest neighbors: one distance per query");
  const Impl& others = *queries.impl_;
  if (others.exponent == impl_->exponent) {
    impl_->query(others.blocks, bound, distance, index);
  } else {
    impl_->query(scaled(others.blocks, impl_->exponent - others.exponent), bound, distance, index);
  }
}

NearestNeighbors NearestNeighborIndex::query(std::span<const Eigen::Vector3f> queries,
                                             float bound) const {
  NearestNeighbors result;
  result.distance.resize(queries.size());
  result.index.resize(queries.size());
  query(queries, bound, result.distance, result.index);
  return result;
}

}  // namespace vggtcd
