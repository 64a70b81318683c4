// SPDX-License-Identifier: Apache-2.0
// Alignment of two epochs: which stages ran, what each one found, and what was chosen.
#include "vggtcd/pipeline/alignment.h"

namespace vggtcd {

std::span<const EnumName<AlignmentMethod>> enum_names(AlignmentMethod) {
  static constexpr EnumName<AlignmentMethod> kNames[] = {{AlignmentMethod::kCoarse, "coarse"},
                                                         {AlignmentMethod::kPaper, "paper"},
                                                         {AlignmentMethod::kRobust, "robust"}};
  return kNames;
}

void AlignmentOptions::validate() const {
  coarse.validate();
  fine.validate();
  robust.validate();
}

namespace {

// Refines all seven parameters and takes the candidate that fits the surfaces of both epochs best.
void choose_robust(const Reconstruction& before, const Reconstruction& after,
                   const AlignmentOptions& options, Alignment& result) {
  const OrientedPoints t1 = oriented_points(before, options.robust.robust_grid_resolution);
  const OrientedPoints t2 = oriented_points(after, options.robust.robust_grid_resolution);
  result.robust = align_robust(t1, t2, result.initial_t2_from_t1, options.robust);
  result.candidates = {{result.chosen, result.initial_t2_from_t1, 0}};
  if (result.fine->verdict == FineVerdict::kRefined) {
    result.candidates.push_back({"fine", result.fine->t2_from_t1, 0});
  }
  if (result.robust->verdict == RobustVerdict::kRefined) {
    result.candidates.push_back({"robust", result.robust->t2_from_t1, 0});
  }
  result.verdict = enum_to_string(result.robust->verdict);
  result.explanation = result.robust->explanation;
  if (!(result.robust->residual_sigma_u > 0)) {  // too little surface to compare anything on
    result.candidates.resize(1);
    return;
  }
  const Alignment::Candidate* best = nullptr;
  for (Alignment::Candidate& candidate : result.candidates) {
    candidate.cost = surface_cost(t1, t2, candidate.t2_from_t1, result.robust->residual_sigma_u,
                                  options.robust.min_normal_cosine);
    if (!best || candidate.cost < best->cost) best = &candidate;
  }
  result.chosen = best->name;
  result.t2_from_t1 = best->t2_from_t1;
  if (best->name == "fine") {
    result.verdict = enum_to_string(result.fine->verdict);
    result.explanation =
        result.fine->explanation + " The full refinement fits the surfaces less well.";
  }
}

}  // namespace

Alignment align(const Reconstruction& before, const Reconstruction& after,
                const InitialAlignment& initial, const AlignmentOptions& options, StageLog& log) {
  Alignment result;
  result.initial_source = initial.source;
  if (initial.joint) {
    log.run("coarse alignment", [&](ProgressStage&) {
      result.coarse = align_coarse(before, after, *initial.joint, options.coarse);
    });
    result.initial_t2_from_t1 = result.coarse->t2_from_t1;
    result.chosen = result.verdict = "coarse";
    result.explanation = fmt::format(
        "Aligned through the joint pass over {} and {} keyframes; residuals {:.3g} and {:.3g} in "
        "its "
        "units.",
        initial.joint->keyframes_t1.size(), initial.joint->keyframes_t2.size(),
        result.coarse->t1.rms_residual_u, result.coarse->t2.rms_residual_u);
  } else {
    result.initial_t2_from_t1 = initial.t2_from_t1;
    result.chosen = "initial";
    result.verdict = "given";
    result.explanation = fmt::format("The alignment was given ({}).", initial.source);
  }
  result.t2_from_t1 = result.initial_t2_from_t1;

  if (options.method != AlignmentMethod::kCoarse) {
    log.run("fine alignment", [&](ProgressStage&) {
      result.fine = align_fine(before, after, result.initial_t2_from_t1, options.fine);
    });
  }
  if (options.method == AlignmentMethod::kPaper) {
    result.t2_from_t1 = result.fine->t2_from_t1;
    if (result.fine->verdict == FineVerdict::kRefined) result.chosen = "fine";
    result.verdict = enum_to_string(result.fine->verdict);
    result.explanation = result.fine->explanation;
  }
  if (options.method == AlignmentMethod::kRobust) {
    log.run("robust alignment",
            [&](ProgressStage&) { choose_robust(before, after, options, result); });
  }
  return result;
}

}  // namespace vggtcd
