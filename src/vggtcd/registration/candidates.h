// SPDX-License-Identifier: Apache-2.0
// The adaptive choice: of several similarities between two epochs the one that fits the surfaces
// of both best (method robust).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "vggtcd/geometry/sim3.h"
#include "vggtcd/registration/fine.h"
#include "vggtcd/registration/robust.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

struct AlignmentCandidate {
  std::string name;
  Sim3 t2_from_t1;
  double cost = 0;  // surface_cost, at one scale for all candidates
};

struct AlignmentChoice {
  Sim3 t2_from_t1;
  std::string chosen;       // the name of a candidate
  std::string verdict;      // of the stage it came from, machine-readable
  std::string explanation;  // one sentence
  RobustResult robust;
  std::vector<AlignmentCandidate> candidates;  // what was compared; the smallest cost was chosen
};

// Refines all seven parameters from `initial` (its name is what it is called in the result) and
// takes the candidate that fits best: `initial`, the fine stage's or the robust refinement's.
// `initial_uncertainty` is the coarse stage's (coarse_uncertainty), if it ran.
AlignmentChoice choose_alignment(const Reconstruction& before, const Reconstruction& after,
                                 const AlignmentCandidate& initial,
                                 const std::optional<InitialUncertainty>& initial_uncertainty,
                                 const FineResult& fine, const RobustOptions& options);

}  // namespace vggtcd
