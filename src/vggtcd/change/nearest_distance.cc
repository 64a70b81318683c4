// SPDX-License-Identifier: Apache-2.0
// Change detection by bidirectional nearest-neighbour distance (section 3.4 of the paper).
#include "vggtcd/change/nearest_distance.h"

#include <cmath>
#include <limits>
#include <span>

#include "vggtcd/geometry/nearest_neighbors.h"
#include "vggtcd/geometry/robust_extent.h"
#include "vggtcd/scene/confidence.h"
#include "vggtcd/scene/point_cloud.h"

namespace vggtcd {
namespace {

// The confident points of an epoch in T2's frame. The confidences are not kept: at full size every
// array here has 8.5 million entries.
PointCloud confident_points(const Reconstruction& epoch, const Sim3& t2_from_epoch,
                            const char* name) {
  PointCloud cloud = unproject(epoch, confidence_threshold(epoch), t2_from_epoch);
  if (cloud.size() == 0) {
    throw_error(ErrorCode::kDegenerate, "{} epoch: no point is left above the median confidence",
                name);
  }
  cloud.confidence = {};
  return cloud;
}

EpochChange scatter(const std::vector<float>& distance, const std::vector<uint32_t>& pixels,
                    size_t num_pixels, float threshold) {
  EpochChange change;
  change.score.assign(num_pixels, std::numeric_limits<float>::quiet_NaN());
  change.points = static_cast<int64_t>(pixels.size());
  for (size_t i = 0; i < pixels.size(); ++i) {
    change.score[pixels[i]] = distance[i];
    change.changed += distance[i] > threshold ? 1 : 0;
  }
  return change;
}

}  // namespace

void ChangeOptions::validate() const {
  check_field(threshold_fraction > 0, "threshold_fraction", threshold_fraction,
              "a positive number");
  check_field(bound_fraction >= threshold_fraction, "bound_fraction", bound_fraction,
              "at least threshold_fraction");
}

ChangeSet detect_changes(const Reconstruction& before, const Reconstruction& after,
                         const Sim3& t2_from_t1, const ChangeOptions& options) {
  options.validate();
  PointCloud t1 = confident_points(before, t2_from_t1, "before");
  PointCloud t2 = confident_points(after, {}, "after");
  ChangeSet result;
  result.scene_extent_u = robust_extent(t2.positions);
  result.threshold_u = options.threshold_fraction * result.scene_extent_u;
  result.bound_u = options.bound_fraction * result.scene_extent_u;

  const float bound = static_cast<float>(result.bound_u);
  std::vector<float> distance_t1(t1.size()), distance_t2(t2.size());
  {
    const NearestNeighborIndex index_t1(t1.positions);
    t1.positions = {};
    const NearestNeighborIndex index_t2(t2.positions);
    t2.positions = {};
    index_t2.query(index_t1, bound, distance_t1);
    index_t1.query(index_t2, bound, distance_t2);
  }
  const float threshold = static_cast<float>(result.threshold_u);
  result.t1 = scatter(distance_t1, t1.pixels, before.num_pixels(), threshold);
  result.t2 = scatter(distance_t2, t2.pixels, after.num_pixels(), threshold);
  return result;
}

}  // namespace vggtcd
