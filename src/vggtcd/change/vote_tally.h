// SPDX-License-Identifier: Apache-2.0
// Sums of votes: those of one point while photos testify, and those about a pixel when they are
// counted. Between the two they are whole steps in a VoteGrid, so no order matters.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "vggtcd/change/vote_grid.h"
#include "vggtcd/change/witness.h"
#include "vggtcd/geometry/point_variance.h"

namespace vggtcd {

// What the sums are measured in, and what a gap must exceed.
struct VoteScale {
  double gap_unit = 1;       // T2 units of a step
  float weight_steps_u = 1;  // weight of a vote times its depth, T2 units
  float tolerance_sigmas = 4;
  PointVariance registration;
};
VoteScale vote_scale(double scene_extent_u, double tolerance_sigmas,
                     const PointVariance& registration);

inline constexpr float kMaxEvidence = 8;      // sigmas; a vote can say no more
inline constexpr float kEvidenceSteps = 256;  // fixed-point steps of a sigma
inline constexpr int kMaxVoteWeight = 256;

// The votes of one point, in T2 units; `weight` is in whole steps.
struct PointVotes {
  uint32_t count = 0;
  int weight = 0, through = 0;
  float gap = 0, evidence = 0, sigma = 0;  // weighted

  // Near photos weigh more, as 1 / z.
  void cast(const Testimony& said, const VoteScale& scale) {
    if (said.vote != Vote::kSees && said.vote != Vote::kLooksThrough) return;
    // A point may be as near to the camera as it likes: bounded before it becomes an integer.
    const float most = static_cast<float>(kMaxVoteWeight);
    const int steps =
        std::max(1, static_cast<int>(std::min(scale.weight_steps_u / said.z + 0.5f, most)));
    const float w = static_cast<float>(steps);
    ++count;
    weight += steps;
    if (said.vote == Vote::kLooksThrough) through += steps;
    gap += w * said.gap_u;
    evidence += w * std::clamp(said.gap_u / said.sigma_u, -kMaxEvidence, kMaxEvidence);
    sigma += w * said.sigma_u;
  }
  Votes rounded(const VoteScale& scale) const {
    return {.points = 1,
            .count = count,
            .weight = weight,
            .through = through,
            .gap = std::llround(static_cast<double>(gap) / scale.gap_unit),
            .evidence = std::llround(evidence * kEvidenceSteps),
            .sigma = std::llround(static_cast<double>(sigma) / scale.gap_unit)};
  }
};

// The votes about a pixel per point that asked, so that every pixel counts the same.
struct Tally {
  float points = 0, count = 0, weight = 0, through = 0, gap = 0, evidence = 0, sigma = 0;

  Tally() = default;
  Tally(const Votes& votes, const VoteScale& scale) {
    if (votes.points == 0) return;
    const double share = 1.0 / votes.points, unit = share * scale.gap_unit;
    points = 1;
    count = static_cast<float>(share * votes.count);
    weight = static_cast<float>(share * static_cast<double>(votes.weight));
    through = static_cast<float>(share * static_cast<double>(votes.through));
    gap = static_cast<float>(unit * static_cast<double>(votes.gap));
    evidence = static_cast<float>(share * static_cast<double>(votes.evidence) /
                                  static_cast<double>(kEvidenceSteps));
    sigma = static_cast<float>(unit * static_cast<double>(votes.sigma));
  }
  void operator+=(const Tally& other) {
    points += other.points;
    count += other.count;
    weight += other.weight;
    through += other.through;
    gap += other.gap;
    evidence += other.evidence;
    sigma += other.sigma;
  }
};

}  // namespace vggtcd
