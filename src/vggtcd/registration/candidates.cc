// SPDX-License-Identifier: Apache-2.0
// Comparing candidates by one cost, on tie points or the surfaces of both epochs.
#include "vggtcd/registration/candidates.h"

#include <algorithm>

#include "vggtcd/core/error.h"
#include "vggtcd/registration/tie_weights.h"
#include "vggtcd/scene/oriented_points.h"

namespace vggtcd {

RobustStart start_from_joint(const Reconstruction& before, const Reconstruction& after,
                             const JointReconstruction& joint, const CoarseResult& coarse,
                             const CoarseOptions& coarse_options, const RobustOptions& options) {
  if (!options.relative_depth)
    return {{"coarse", coarse.t2_from_t1, 0}, coarse_uncertainty(coarse)};
  const CoarseResult by_depth =
      align_coarse(before, after, joint, coarse_options, PairWeights::kInverseSquaredDepth);
  return {{"coarse_by_depth", by_depth.t2_from_t1, 0}, coarse_uncertainty(by_depth)};
}

AlignmentChoice choose_alignment(const Reconstruction& before, const Reconstruction& after,
                                 const RobustStart& start, const FineResult& fine,
                                 const RobustOptions& options) {
  const AlignmentCandidate& initial = start.initial;
  const OrientedPoints t1 = oriented_points(before, options.robust_grid_resolution);
  const OrientedPoints t2 = oriented_points(after, options.robust_grid_resolution);
  AlignmentChoice choice;
  std::vector<TiePoint> ties;
  if (options.tie_points) {
    ties = find_tie_points(before, after, initial.t2_from_t1, options.tie_photos);
  }
  choice.robust = align_robust(t1, t2, ties, initial.t2_from_t1, start.uncertainty, options);
  // Candidates are compared by the ties that the refinement went by.
  if (choice.robust.ties_contradict) ties = agreeing_ties(ties, initial.t2_from_t1);
  choice.t2_from_t1 = choice.surface_t2_from_t1 = initial.t2_from_t1;
  choice.chosen = initial.name;
  choice.verdict = enum_to_string(choice.robust.verdict);
  choice.explanation = choice.robust.explanation;
  choice.candidates = {initial};
  // Too little to compare anything on.
  if (choice.robust.verdict == RobustVerdict::kKeptInitialFewPairs) return choice;
  choice.candidates[0].cost = choice.robust.cost_initial;
  if (fine.verdict == FineVerdict::kRefined) {
    choice.candidates.push_back(
        {"fine", fine.t2_from_t1,
         candidate_cost(t1, t2, ties, fine.t2_from_t1, choice.robust, options)});
  }
  if (choice.robust.refined()) {
    choice.candidates.push_back({"robust", choice.robust.t2_from_t1, choice.robust.cost_final});
  }
  const AlignmentCandidate& best = *std::min_element(
      choice.candidates.begin(), choice.candidates.end(),
      [](const AlignmentCandidate& a, const AlignmentCandidate& b) { return a.cost < b.cost; });
  choice.chosen = best.name;
  choice.t2_from_t1 = choice.surface_t2_from_t1 = best.t2_from_t1;
  if (best.name == "robust") choice.surface_t2_from_t1 = choice.robust.surface_t2_from_t1;
  if (best.name == "fine") {
    choice.verdict = enum_to_string(fine.verdict);
    choice.explanation = fmt::format(
        "{} The full refinement fits the {} less well.", fine.explanation,
        choice.robust.compared_by == CandidateCost::kSurfaces ? "surfaces" : "tie points");
  }
  return choice;
}

}  // namespace vggtcd
