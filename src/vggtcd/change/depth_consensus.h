// SPDX-License-Identifier: Apache-2.0
// What the photos of one epoch agree on: the smooth part of a photo's depths that the other photos
// of its epoch do not confirm.
#pragma once

#include "vggtcd/change/depth_correction.h"
#include "vggtcd/change/witness.h"
#include "vggtcd/geometry/sim3.h"

namespace vggtcd {

struct ConsensusOptions {
  int max_views = 12;            // photos of the same epoch that a photo is held against
  double max_gap = 0.06;         // relative; what differs by more is another surface
  double max_pair_sigma = 0.04;  // relative; pairs that agree less say nothing
};

// Each photo's points, on a coarse grid, are held against the depths of the photos of the same
// epoch that overlap it most, each pair aligned (pair_alignment.h), so that only what cannot be
// explained by its pose and scale is left. At every node the point moves by log(r) along its ray
// such that
//   sum_j w_j (g_j + s_j log r)^2 + (log r)^2 is least,
// g_j the gap of pair j, s_j its slope, w_j Tukey's weight; the last term is the photo's own
// measurement, as good as any of the others. Sums run over the 3 x 3 nodes around. A gap between
// two photos of n that see a surface is then their difference of means, as M3C2 compares epochs
// (Lague et al. 2013), not of single photos.
DepthCorrection depth_consensus(const Witness& own, const Sim3& t2_from_epoch, float min_confidence,
                                double scene_extent_u, const ConsensusOptions& options);

}  // namespace vggtcd
