// SPDX-License-Identifier: Apache-2.0
// Whether an alignment can be believed at all: do the epochs overlap, do their surfaces agree more
// than by chance, and did the joint pass fit the epochs.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "vggtcd/core/options.h"
#include "vggtcd/geometry/sim3.h"
#include "vggtcd/registration/coarse.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

// How an epoch's sample points lie on the other one's surfaces, both directions together.
struct SurfaceAgreement {
  double seen_share_t1 = 0;  // of T1's sample points: inside at least one photo of T2
  double seen_share_t2 = 0;
  int64_t pairs = 0;     // sample point and photo of the other epoch that contains it and has depth
  double agreeing = 0;   // share of the pairs whose depths differ by less than kSameDepth
  double by_chance = 0;  // the same if the photo's depths were dealt out to its pixels anew

  // Cohen's kappa: 0 where chance explains all, 1 where all agree.
  double above_chance() const;
};
inline constexpr double kSameDepth = 0.05;  // of the depth

// Samples 16 x 16 pixels of every photo, without the tenth that is least confident, and asks the 8
// photos of the other epoch that overlap it most (scene/view_overlap.h). What has changed does not
// agree either, so the share falls with the change; a wrong similarity leaves chance alone.
SurfaceAgreement surface_agreement(const Reconstruction& before, const Reconstruction& after,
                                   const Sim3& t2_from_t1);

enum class Plausibility {
  kBelievable,
  kDoubtful,          // worth a notice
  kNoOverlap,         // no photo of one epoch sees what the other saw
  kSurfacesDisagree,  // no more than by chance
  kJointDisagrees     // the joint pass does not show the keyframes that it is said to show
};
std::span<const EnumName<Plausibility>> enum_names(Plausibility);

struct PlausibilityResult {
  Plausibility verdict = Plausibility::kBelievable;
  std::string explanation;  // one sentence with its numbers
  SurfaceAgreement surfaces;
  // Of the joint pass' points of each epoch's keyframes: the share of their variance that the
  // coarse similarity does not explain.
  std::optional<double> joint_unexplained_t1, joint_unexplained_t2;

  // What no sane user would want the output of.
  bool refused() const {
    return verdict != Plausibility::kBelievable && verdict != Plausibility::kDoubtful;
  }
};

// The verdict on these numbers; docs/numerics.md has the thresholds and what they rest on.
// `doubts`: sentences about how the alignment was found; any makes it doubtful at best.
PlausibilityResult judge_plausibility(const SurfaceAgreement& surfaces,
                                      const std::optional<CoarseResult>& coarse,
                                      std::span<const std::string> doubts = {});

}  // namespace vggtcd
