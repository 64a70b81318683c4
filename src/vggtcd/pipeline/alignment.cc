// SPDX-License-Identifier: Apache-2.0
// Alignment of two epochs: which stages ran, what each one found, and what was chosen.
#include "vggtcd/pipeline/alignment.h"

#include "vggtcd/scene/local_frame.h"

namespace vggtcd {

std::span<const EnumName<AlignmentMethod>> enum_names(AlignmentMethod) {
  static constexpr EnumName<AlignmentMethod> kNames[] = {{AlignmentMethod::kAuto, "auto"},
                                                         {AlignmentMethod::kCoarse, "coarse"},
                                                         {AlignmentMethod::kPaper, "paper"},
                                                         {AlignmentMethod::kRobust, "robust"}};
  return kNames;
}

AlignmentMethod resolve_method(AlignmentMethod method, InitialSource source) {
  if (method != AlignmentMethod::kAuto) return method;
  switch (source) {
    case InitialSource::kOwnJointPass:
      return AlignmentMethod::kRobust;
    case InitialSource::kOneModel:
      return AlignmentMethod::kCoarse;
    case InitialSource::kGiven:
      break;
  }
  return AlignmentMethod::kPaper;
}

void AlignmentOptions::validate() const {
  coarse.validate();
  fine.validate();
  robust.validate();
}

Alignment align(const Reconstruction& before, const Reconstruction& after,
                const InitialAlignment& initial, const AlignmentOptions& options, StageLog& log) {
  const AlignmentMethod method = resolve_method(options.method, initial.kind());
  Alignment result;
  result.initial_source = initial.source;
  if (initial.joint) {
    log.run("coarse alignment", [&](ProgressStage&) {
      result.coarse = align_coarse(before, after, *initial.joint, options.coarse);
    });
    result.initial_t2_from_t1 = result.coarse->t2_from_t1;
    const SimilarityCovariance measured = coarse_uncertainty(*result.coarse).similarity;
    if (measured.covariance.trace() > 0) result.uncertainty = measured;
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
  result.surface_uncertainty = result.uncertainty;

  if (method != AlignmentMethod::kCoarse) {
    log.run("fine alignment", [&](ProgressStage&) {
      result.fine = align_fine(before, after, result.initial_t2_from_t1, options.fine);
    });
  }
  if (method == AlignmentMethod::kPaper) {
    result.t2_from_t1 = result.fine->t2_from_t1;
    if (result.fine->verdict == FineVerdict::kRefined) result.chosen = "fine";
    result.verdict = enum_to_string(result.fine->verdict);
    result.explanation = result.fine->explanation;
  }
  result.surface_t2_from_t1 = result.t2_from_t1;
  if (method == AlignmentMethod::kRobust) {
    log.run("robust alignment", [&](ProgressStage&) {
      RobustStart start{{result.chosen, result.initial_t2_from_t1, 0}, {}};
      if (initial.joint) {
        start = start_from_joint(before, after, *initial.joint, *result.coarse, options.coarse,
                                 options.robust);
      }
      AlignmentChoice choice = choose_alignment(before, after, start, *result.fine, options.robust);
      result.t2_from_t1 = choice.t2_from_t1;
      result.surface_t2_from_t1 = choice.surface_t2_from_t1;
      result.chosen = std::move(choice.chosen);
      result.verdict = std::move(choice.verdict);
      result.explanation = std::move(choice.explanation);
      result.robust = std::move(choice.robust);
      if (result.chosen == "robust") {
        result.uncertainty = {result.robust->covariance, result.robust->pivot_in_t2};
        result.surface_uncertainty = {result.robust->surface_covariance,
                                      result.robust->pivot_in_t2};
      } else if (result.chosen == start.initial.name && start.uncertainty &&
                 start.uncertainty->similarity.covariance.trace() > 0) {
        result.uncertainty = result.surface_uncertainty = start.uncertainty->similarity;
      }
      result.candidates = std::move(choice.candidates);
    });
  }
  log.run("plausibility", [&](ProgressStage&) {
    result.plausibility = judge_plausibility(
        surface_agreement(before, after, result.surface_t2_from_t1), result.coarse,
        result.robust ? result.robust->doubts() : std::vector<std::string>());
  });
  const PlausibilityResult& plausibility = result.plausibility;
  if (plausibility.refused() && !options.accept_alignment) {
    throw_error(ErrorCode::kImplausible, "{}; {}; --accept-alignment goes on regardless",
                plausibility.explanation, initial.remedy);
  }
  if (plausibility.verdict != Plausibility::kBelievable) {
    log.progress().notice(plausibility.explanation);
  }
  return result;
}

Alignment in_worlds(Alignment alignment, const FrameOrigins& origins) {
  const auto express = [&](Sim3& t2_from_t1) {
    t2_from_t1 = between_worlds(t2_from_t1, origins.t1, origins.t2);
  };
  express(alignment.t2_from_t1);
  express(alignment.surface_t2_from_t1);
  express(alignment.initial_t2_from_t1);
  if (alignment.coarse) {
    express(alignment.coarse->t2_from_t1);
    for (const auto& [epoch, origin] : {std::pair(&alignment.coarse->t1, origins.t1),
                                        std::pair(&alignment.coarse->t2, origins.t2)}) {
      epoch->joint_from_epoch = between_worlds(epoch->joint_from_epoch, origin, origins.joint);
    }
  }
  if (alignment.fine) express(alignment.fine->t2_from_t1);
  if (alignment.robust) {
    express(alignment.robust->t2_from_t1);
    express(alignment.robust->surface_t2_from_t1);
    alignment.robust->pivot_in_t2 += origins.t2;
  }
  for (AlignmentCandidate& candidate : alignment.candidates) express(candidate.t2_from_t1);
  for (auto* uncertainty : {&alignment.uncertainty, &alignment.surface_uncertainty}) {
    if (*uncertainty) (*uncertainty)->pivot += origins.t2;
  }
  return alignment;
}

}  // namespace vggtcd
