// SPDX-License-Identifier: Apache-2.0
// How far the initial similarity and each photo may be off, measured on the keyframes that the
// coarse stage rests on.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "vggtcd/geometry/sim3.h"
#include "vggtcd/registration/small_similarity.h"

namespace vggtcd {

// What one keyframe says about a similarity that was fitted to all of them: its own points against
// their counterparts, in the target frame.
struct KeyframeWitness {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  // weighted
  // The least-squares similarity about the centre that maps its points onto the counterparts: what
  // the common fit leaves of this keyframe.
  Vector7 offset = Vector7::Zero();
  Matrix7 information = Matrix7::Zero();  // sum of w J^T J of its point pairs about it
};

// `mapped` are the keyframe's points after the common fit, `targets` their counterparts, `weights`
// those of the common fit (positive). Fewer than 3 pairs, or pairs that do not determine a
// similarity, give a witness without information.
KeyframeWitness keyframe_witness(std::span<const Eigen::Vector3d> mapped,
                                 std::span<const Eigen::Vector3d> targets,
                                 std::span<const double> weights);

struct InitialUncertainty {
  SimilarityCovariance similarity;  // of t2_from_t1, in T2
  FrameSpread frame;                // of one photo in its own pass, in T2
};

// Each keyframe errs as a whole: a similarity about its centre with independent parts whose
// deviations are estimated from all witnesses' offsets. The fit of an epoch is the weighted mean of
// its keyframes, A = sum A_k with A_k = J_k^T J_k; so its covariance is A^-1 (sum A_k V A_k^T)
// A^-1, and that of t2_from_t1 is the sum of both epochs'. The offsets hold the errors of two
// passes, the epoch's and the joint one; taken to be alike, half of the variance is the photo's in
// its own pass. Witnesses are in the joint frame.
// Without two usable witnesses per epoch the result has covariance zero.
InitialUncertainty coarse_uncertainty(std::span<const KeyframeWitness> t1,
                                      std::span<const KeyframeWitness> t2,
                                      const Sim3& joint_from_t2);

}  // namespace vggtcd
