// SPDX-License-Identifier: Apache-2.0
// Alignment of two epochs: which stages ran, what each one found, and what was chosen.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "vggtcd/core/options.h"
#include "vggtcd/geometry/sim3.h"
#include "vggtcd/pipeline/stage_log.h"
#include "vggtcd/registration/candidates.h"
#include "vggtcd/registration/coarse.h"
#include "vggtcd/registration/fine.h"
#include "vggtcd/registration/plausibility.h"
#include "vggtcd/registration/robust.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

enum class AlignmentMethod {
  kAuto,    // what resolve_method says
  kCoarse,  // the initial similarity as it is
  kPaper,   // and Algorithm 1 on top of it
  kRobust   // the best of initial, Algorithm 1 and the robust Sim(3) refinement
};
std::span<const EnumName<AlignmentMethod>> enum_names(AlignmentMethod);

// Where the similarity before refinement comes from.
enum class InitialSource {
  kOwnJointPass,  // a joint pass that is an estimate of its own
  kOneModel,      // both epochs are parts of one model, which the joint reconstruction shows
  kGiven          // by the user
};

// What kAuto stands for: robust, coarse, paper. In one model, whose photos were placed together,
// there is nothing to refine: surfaces that each epoch measures with errors of its own know less
// about it than the photos did. Any other method is itself.
AlignmentMethod resolve_method(AlignmentMethod method, InitialSource source);

struct AlignmentOptions {
  AlignmentMethod method = AlignmentMethod::kAuto;
  bool find_sky = true;
  bool shared_intrinsics = false;
  CoarseOptions coarse;
  FineOptions fine;
  RobustOptions robust;
  bool accept_alignment = false;  // go on where the epochs do not fit together

  static constexpr auto fields = [](auto&& self, auto&& field) {
    field(
        "method", self.method,
        "auto: robust after a network's joint pass; coarse where photos of both epochs were placed "
        "in one model; where the alignment is given, the paper's refinement; change by free-space "
        "votes in each case. robust: all seven parameters from places that photos of both epochs "
        "show alike, "
        "from the static surfaces and from what each photo shows, and change by free-space votes. "
        "paper: the joint pass, the translation refinement with its residual self-check, and "
        "change by nearest-neighbour distance, all as in the paper. coarse: the joint pass "
        "alone, change as in paper.");
    field("find_sky", self.find_sky,
          "Find the sky by the network's confidence and leave it out: it has no surface.");
    field("shared_intrinsics", self.shared_intrinsics,
          "Give all frames of a pass the first frame's intrinsics and rescale their depths to "
          "match, as "
          "the authors' own script does.");
    field("coarse", self.coarse, "");
    field("fine", self.fine, "");
    field("robust", self.robust, "");
    field(
        "accept_alignment", self.accept_alignment,
        "Go on with an alignment that is refused: no overlap, surfaces that agree no more than by "
        "chance, a joint pass of other photos.");
  };
  void validate() const;
};

// Where the similarity before refinement comes from.
struct InitialAlignment {
  const JointReconstruction* joint = nullptr;  // the coarse stage estimates it, or:
  Sim3 t2_from_t1;                             // it is given
  std::string source;                          // "joint pass", "aligned epochs", or a file name
  std::string remedy;                          // what to do if the epochs do not fit together
  bool own_joint_pass = false;  // joint is an estimate of its own, not a part of one common model

  InitialSource kind() const {
    if (!joint) return InitialSource::kGiven;
    return own_joint_pass ? InitialSource::kOwnJointPass : InitialSource::kOneModel;
  }
};

struct Alignment {
  // Chosen: x_T2 = s R x_T1 + t. The first carries the cameras: trajectories, COLMAP, metres by
  // cameras. The second fits what the photos show: change, things, PLY, plausibility. They differ
  // where the robust refinement was chosen.
  Sim3 t2_from_t1, surface_t2_from_t1;
  Sim3 initial_t2_from_t1;                     // before refinement
  std::string initial_source;                  // as in InitialAlignment
  std::optional<CoarseResult> coarse;          // with a joint pass
  std::optional<FineResult> fine;              // with methods paper and robust
  std::optional<RobustResult> robust;          // with method robust
  std::vector<AlignmentCandidate> candidates;  // with method robust: what was compared
  // "coarse", "fine", "initial" and, with method robust, "robust" or "coarse_by_depth" (the coarse
  // stage with pairs weighed by 1 / depth^2, which that method starts from).
  std::string chosen;
  // Of t2_from_t1 where it is known: measured on the keyframes of the joint pass, and with method
  // robust on the surfaces as well. The paper's translation update is not known to reduce it.
  std::optional<SimilarityCovariance> uncertainty;
  std::optional<SimilarityCovariance> surface_uncertainty;  // the same of surface_t2_from_t1
  std::string verdict;      // machine-readable: refined, kept_coarse_..., coarse, given
  std::string explanation;  // one sentence
  PlausibilityResult plausibility;
};

// Runs the stages that the method asks for. Reconstructions are as read, and similarities are
// between their local frames; with shared_intrinsics the caller has applied share_intrinsics to all
// of them. Throws Error{kImplausible} for an alignment
// that nobody would want the changes of, unless options.accept_alignment.
Alignment align(const Reconstruction& before, const Reconstruction& after,
                const InitialAlignment& initial, const AlignmentOptions& options, StageLog& log);

// Where the local frames that were computed in have their origins (scene/local_frame.h).
struct FrameOrigins {
  Eigen::Vector3d t1 = Eigen::Vector3d::Zero(), t2 = t1, joint = t1;
};

// The same alignment between the worlds of the files, as results state it.
Alignment in_worlds(Alignment alignment, const FrameOrigins& origins);

}  // namespace vggtcd
