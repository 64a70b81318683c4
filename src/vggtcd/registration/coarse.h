// SPDX-License-Identifier: Apache-2.0
// Coarse registration through the joint pass over keyframes (section 3.2 of the paper).
#pragma once

#include <cstdint>
#include <vector>

#include "vggtcd/core/options.h"
#include "vggtcd/geometry/sim3.h"
#include "vggtcd/registration/initial_uncertainty.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

struct CoarseOptions {
  int64_t max_correspondences = 5000;  // M of the paper, >= 3
  uint64_t seed = 0;                   // of the random subsampling

  static constexpr auto fields = [](auto&& self, auto&& field) {
    field("max_correspondences", self.max_correspondences,
          "Coarse: at most this many point pairs per epoch (the paper's M); at least 3.");
    field("seed", self.seed, "Coarse: seed of the random choice of point pairs.");
  };
  void validate() const;
};

// What a pixel pair weighs. The paper: all the same. A depth errs in proportion to itself and a
// camera's turn moves what it sees in proportion to its distance, so the variance of a point grows
// with the square of its depth.
enum class PairWeights { kEqual, kInverseSquaredDepth };

// One epoch against the joint pass.
struct EpochToJoint {
  Sim3 joint_from_epoch;
  int64_t candidates = 0;                  // pixel pairs above the confidence median
  int64_t correspondences = 0;             // of them used, at most M
  double rms_residual_u = 0;               // of the used pairs, in joint units
  double unexplained_share = 0;            // rms_residual_u^2 / variance of the points in the joint
  std::vector<KeyframeWitness> keyframes;  // of the used pairs, in the joint frame
};

struct CoarseResult {
  Sim3 t2_from_t1;
  EpochToJoint t1, t2;
};

// Umeyama's closed form over the pixels that keyframe i has in both reconstructions: pixel (u, v)
// of frame keyframes[i] of the epoch and of frame first_joint_frame + i of the joint pass. Kept are
// pixels with depth in both whose confidence in the epoch's own pass is above the median over the
// whole epoch (scene/confidence.h), but for up to one in a hundred whose depths differ so much that
// they show two surfaces. Throws Error{kDegenerate} naming `epoch_name` if fewer than 3
// pairs are left or they do not determine a similarity (a line, a point), Error{kInput} if the
// frame sizes differ.
EpochToJoint align_epoch_to_joint(const Reconstruction& epoch, const Reconstruction& joint,
                                  const std::vector<int>& keyframes, int first_joint_frame,
                                  const char* epoch_name, const CoarseOptions& options,
                                  PairWeights weights = PairWeights::kEqual);

// Eq. 3: s = s1 / s2, R = R2^T R1, t = R2^T (t1 - t2) / s2.
Sim3 compose_through_joint(const Sim3& joint_from_t1, const Sim3& joint_from_t2);

// How far the result and each photo may be off, from the spread of the keyframes.
InitialUncertainty coarse_uncertainty(const CoarseResult& coarse);

// The whole stage: both epochs to the joint frame, composed.
CoarseResult align_coarse(const Reconstruction& before, const Reconstruction& after,
                          const JointReconstruction& joint, const CoarseOptions& options,
                          PairWeights weights = PairWeights::kEqual);

}  // namespace vggtcd
