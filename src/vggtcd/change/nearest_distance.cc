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

// The confident points of an epoch in T2, in pixel order: which pixels they belong to follows from
// the same walk over the photos. Made when they are asked for: at full size every array of them has
// 8.5 million entries.
ConfidentPoints confident_points(const Reconstruction& epoch, float min_confidence,
                                 const Sim3& t2_from_epoch, const char* name) {
  ConfidentPoints points(epoch, min_confidence, t2_from_epoch);
  if (points.size() == 0) {
    throw_error(ErrorCode::kDegenerate, "{} epoch: no point is left above the median confidence",
                name);
  }
  return points;
}

EpochChange scatter(const std::vector<float>& distance, const Reconstruction& epoch,
                    float min_confidence, float threshold) {
  EpochChange change;
  change.score.assign(epoch.num_pixels(), std::numeric_limits<float>::quiet_NaN());
  size_t point = 0;
  for (size_t pixel = 0; pixel < epoch.num_pixels(); ++pixel) {
    if (!is_confident(epoch, pixel, min_confidence)) continue;
    change.score[pixel] = distance[point];
    change.changed += distance[point] > threshold ? 1 : 0;
    ++point;
  }
  check(point == distance.size(), "a distance for every confident pixel");
  change.points = static_cast<int64_t>(point);
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
  const float min_confidence_t1 = confidence_threshold(before);
  const float min_confidence_t2 = confidence_threshold(after);
  ChangeSet result;
  std::vector<float> distance_t1, distance_t2;
  {
    const ConfidentPoints points_t1 =
        confident_points(before, min_confidence_t1, t2_from_t1, "before");
    const ConfidentPoints points_t2 = confident_points(after, min_confidence_t2, {}, "after");
    result.scene_extent_u = robust_extent(unproject(after, min_confidence_t2).positions);
    result.threshold_u = options.threshold_fraction * result.scene_extent_u;
    result.bound_u = options.bound_fraction * result.scene_extent_u;
    const NearestNeighborIndex index_t1(points_t1);
    const NearestNeighborIndex index_t2(points_t2);

    const float bound = static_cast<float>(result.bound_u);
    distance_t1.resize(index_t1.size());
    index_t2.query(index_t1, bound, distance_t1);
    distance_t2.resize(index_t2.size());
    index_t1.query(index_t2, bound, distance_t2);
  }
  const float threshold = static_cast<float>(result.threshold_u);
  result.t1 = scatter(distance_t1, before, min_confidence_t1, threshold);
  result.t2 = scatter(distance_t2, after, min_confidence_t2, threshold);
  return result;
}

}  // namespace vggtcd
