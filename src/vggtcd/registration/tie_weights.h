// SPDX-License-Identifier: Apache-2.0
// How much each tie point counts under a similarity, and how well a similarity fits them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "vggtcd/geometry/sim3.h"
#include "vggtcd/registration/frame_equations.h"
#include "vggtcd/registration/small_similarity.h"
#include "vggtcd/registration/tie_points.h"

namespace vggtcd {

struct WeighedTies {
  std::vector<PointPair> points;  // in T2; Tukey's weight and the variance are in the information
  double variance = 0;  // of the squared distances against what the ties' covariances promise
  int64_t used = 0;     // ties between the epochs that are not outliers
};

// Distances are Mahalanobis distances of a tie's two points, s^2 R C1 R^T + C2 their covariance
// between the epochs;
// the variance is 2.366 times less than their median square (chi^2 with three degrees of freedom).
// With `photos` what the photos' own errors explain, given `theta`, is taken off before: else a
// photo that errs as a whole looks like many outliers.
WeighedTies weigh_ties(std::span<const TiePoint> ties, const Sim3& t2_from_t1,
                       const PhotoErrors* photos, const Vector7& theta);

// The ties that agree with the others of their pair of photos, whatever both photos err in common:
// of each pair those whose difference is near the pair's median difference, within three times
// what they promise, if they are at least six and half of the pair's; the other pairs are left out
// as a whole. In their order. Ties of one pair stand next to each other, as find_tie_points leaves
// them.
std::vector<TiePoint> agreeing_ties(std::span<const TiePoint> ties, const Sim3& t2_from_t1);

// The mean Tukey loss (0 to 1) of the distances at that variance, of ties between the epochs; of
// those within one no similarity says anything. At least one tie is between the epochs.
double tie_cost(std::span<const TiePoint> ties, const Sim3& t2_from_t1, double variance);

}  // namespace vggtcd
