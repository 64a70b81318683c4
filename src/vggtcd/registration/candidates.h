// SPDX-License-Identifier: Apache-2.0
// The adaptive choice: of several similarities between two epochs the one that fits
// what both show best (method robust).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "vggtcd/geometry/sim3.h"
#include "vggtcd/registration/coarse.h"
#include "vggtcd/registration/fine.h"
#include "vggtcd/registration/robust.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

struct AlignmentCandidate {
  std::string name;
  Sim3 t2_from_t1;
  double cost = 0;  // candidate_cost, at one scale for all candidates
};

struct AlignmentChoice {
  Sim3 t2_from_t1, surface_t2_from_t1;  // as in RobustResult; the same one of other candidates
  std::string chosen;                   // the name of a candidate
  std::string verdict;                  // of the stage it came from, machine-readable
  std::string explanation;              // one sentence
  RobustResult robust;
  std::vector<AlignmentCandidate> candidates;  // what was compared; the smallest cost was chosen
};

// Where the refinement starts, and how far that may be off if it was measured.
struct RobustStart {
  AlignmentCandidate initial;
  std::optional<InitialUncertainty> uncertainty;
};

// After a joint pass, whose coarse stage found `coarse`: the same fit once more with pairs weighted
// by 1 / depth^2 ("coarse_by_depth") where residuals are relative to depth, else `coarse` itself.
RobustStart start_from_joint(const Reconstruction& before, const Reconstruction& after,
                             const JointReconstruction& joint, const CoarseResult& coarse,
                             const CoarseOptions& coarse_options, const RobustOptions& options);

// Refines all seven parameters from the start and takes the candidate that fits best: the start
// (its name is what it is called in the result), the fine stage's or the robust refinement's.
AlignmentChoice choose_alignment(const Reconstruction& before, const Reconstruction& after,
                                 const RobustStart& start, const FineResult& fine,
                                 const RobustOptions& options);

}  // namespace vggtcd
