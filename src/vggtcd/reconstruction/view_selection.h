// SPDX-License-Identifier: Apache-2.0
// Which photos to compare a photo with, and between which depths, from sparse points.
#pragma once

#include <vector>

#include "vggtcd/reconstruction/colmap_model.h"
#include "vggtcd/reconstruction/plane_sweep.h"

namespace vggtcd {

struct ViewSelectionOptions {
  int max_sources = 5;
  // Median angle between the rays to shared points. Narrower gives no depth, wider no likeness.
  double min_angle_deg = 1.5, best_angle_deg = 8, max_angle_deg = 35;
  int min_shared_points = 12;
};

// What a view needs for its depth.
struct DepthTask {
  std::vector<int> sources;     // view numbers, best first; empty if no neighbour will do
  InverseDepthRange range;      // num_planes unset
  double median_angle_deg = 0;  // over the sources
};

// For every view: the neighbours among `group_of_view`'s same value (the same epoch) that share
// points with it under a good angle, and a range of depth that reaches well beyond its points: from
// 0.6 of the nearest (2 % of them may lie nearer, as outliers) to twice the farthest.
std::vector<DepthTask> plan_depth(const SfmModel& model, const std::vector<int>& group_of_view,
                                  const ViewSelectionOptions& options);

}  // namespace vggtcd
