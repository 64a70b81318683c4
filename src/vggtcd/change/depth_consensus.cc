// SPDX-License-Identifier: Apache-2.0
// What the photos of one epoch agree on.
#include "vggtcd/change/depth_consensus.h"

#include <algorithm>
#include <cmath>

#include "vggtcd/core/parallel.h"
#include "vggtcd/scene/point_cloud.h"
#include "vggtcd/scene/view_overlap.h"

namespace vggtcd {
namespace {

constexpr int kNodesAcross = 60;
constexpr double kMinSigma = 3e-3;  // relative: gates never close further than by its multiple
constexpr double kGateSigmas = 4;

// Of the normal equation of one node: right / (weight + prior) is the step of log r.
struct NodeSum {
  double right = 0, weight = 0;
  int nodes = 0;  // with any witness; each has its own measurement as well
};

// The points of a photo on the grid, and the node that each belongs to.
struct NodePoints {
  std::vector<Eigen::Vector3f> x_in_t2;
  std::vector<size_t> node;
};

NodePoints points_of(const Reconstruction& epoch, size_t frame, const Sim3& t2_from_epoch,
                     float min_confidence, int stride, size_t columns) {
  NodePoints points;
  const PixelRays rays(epoch.views[frame], t2_from_epoch);
  const size_t first = frame * epoch.pixels_per_frame();
  for (int v = 0; v < epoch.height; v += stride) {
    for (int u = 0; u < epoch.width; u += stride) {
      const size_t pixel = first + static_cast<size_t>(v) * static_cast<size_t>(epoch.width) +
                           static_cast<size_t>(u);
      if (!testifies(epoch, pixel, min_confidence)) continue;
      points.x_in_t2.push_back(rays.point(u, v, epoch.depth[pixel]));
      points.node.push_back(static_cast<size_t>(v / stride) * columns +
                            static_cast<size_t>(u / stride));
    }
  }
  return points;
}

void add_pair(const NodePoints& points, const Eigen::Vector3d& center, const WitnessPhoto& photo,
              double scene_extent_u, const ConsensusOptions& options, std::vector<NodeSum>& sums) {
  const PairAlignment pair = align_pair(points.x_in_t2, photo, options.max_gap, scene_extent_u, {});
  if (pair.gap_sigma > options.max_pair_sigma) return;
  const double gate = kGateSigmas * std::max(kMinSigma, pair.gap_sigma);
  for (const SurfaceGap& at : surface_gaps(points.x_in_t2, center, photo, pair)) {
    const double ratio = at.gap / gate;
    if (std::abs(ratio) >= 1) continue;
    const double tukey = (1 - ratio * ratio) * (1 - ratio * ratio);
    NodeSum& sum = sums[points.node[at.point]];
    sum.right -= tukey * at.slope * at.gap;
    sum.weight += tukey * at.slope * at.slope;
  }
}

NodeSum around(const std::vector<NodeSum>& sums, size_t rows, size_t columns, size_t row,
               size_t column) {
  NodeSum total;
  for (size_t y = row > 0 ? row - 1 : 0; y < std::min(rows, row + 2); ++y) {
    for (size_t x = column > 0 ? column - 1 : 0; x < std::min(columns, column + 2); ++x) {
      const NodeSum& sum = sums[y * columns + x];
      if (!(sum.weight > 0)) continue;
      total.right += sum.right;
      total.weight += sum.weight;
      ++total.nodes;
    }
  }
  return total;
}

}  // namespace

DepthCorrection depth_consensus(const Witness& own, const Sim3& t2_from_epoch, float min_confidence,
                                double scene_extent_u, const ConsensusOptions& options) {
  const Reconstruction& epoch = *own.epoch;
  const int stride = std::max(1, epoch.width / kNodesAcross);
  DepthCorrection correction(epoch.num_frames(), epoch.height, epoch.width, stride);
  const size_t rows = correction.rows(), columns = correction.columns();
  const auto views = overlapping_views(epoch, epoch, {}, options.max_views + 1);  // and itself
  parallel_for(epoch.num_frames(), 1, [&](int64_t frame, int64_t) {
    const size_t i = static_cast<size_t>(frame);
    const NodePoints points = points_of(epoch, i, t2_from_epoch, min_confidence, stride, columns);
    const Eigen::Vector3d center = camera_center(own.camera_from_t2[i]);
    std::vector<NodeSum> sums(rows * columns);
    for (const int other : views[i]) {
      const size_t j = static_cast<size_t>(other);
      if (j == i) continue;
      const WitnessPhoto photo{own.camera_from_t2[j], epoch.views[j].pinhole, own.windows(j)};
      add_pair(points, center, photo, scene_extent_u, options, sums);
    }
    for (size_t row = 0; row < rows; ++row) {
      for (size_t column = 0; column < columns; ++column) {
        const NodeSum sum = around(sums, rows, columns, row, column);
        if (sum.nodes == 0) continue;
        correction.node(i, row, column) =
            static_cast<float>(std::exp(sum.right / (sum.weight + sum.nodes)));
      }
    }
  });
  return correction;
}

}  // namespace vggtcd
