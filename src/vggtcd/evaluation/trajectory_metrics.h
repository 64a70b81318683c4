// SPDX-License-Identifier: Apache-2.0
// Trajectory errors of a bi-temporal registration: ATE, RTE, RRE as the VGGT-CD paper's protocol
// computes them.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "vggtcd/geometry/rigid3.h"
#include "vggtcd/geometry/sim3.h"

namespace vggtcd {

// Camera poses of both epochs, camera-from-world, in one frame.
struct BitemporalTrajectory {
  std::vector<Rigid3> t1, t2;
};

// T1's poses mapped by the registration, T2's as they are.
BitemporalTrajectory register_trajectory(std::span<const Rigid3> t1, std::span<const Rigid3> t2,
                                         const Sim3& t2_from_t1);

struct TrajectoryErrors {
  // |truth_from_predicted * c - c_true| over the camera centres of both epochs, in units of the
  // truth.
  double ate_mean = 0, ate_rmse = 0, ate_median = 0;
  // ate_mean / trajectory_length: COLMAP's unit is arbitrary.
  double ate_relative = 0;
  // Means over neighbouring frames within an epoch: the error of the relative translation
  // (predicted ones scaled by truth_from_predicted.scale) and the angle of the relative rotation's
  // error.
  double rte_mean = 0, rre_mean_deg = 0;
  double trajectory_length = 0;  // of the true paths of both epochs, without the gap between them
  int frames = 0;
  Sim3 truth_from_predicted;  // one Umeyama Sim(3) over all camera centres of both epochs
};

// Throws Error{kInput} if an epoch's numbers of frames differ, Error{kDegenerate} if the camera
// centres do not determine a similarity (all on a line, fewer than 3).
TrajectoryErrors evaluate_trajectory(const BitemporalTrajectory& predicted,
                                     const BitemporalTrajectory& truth);

}  // namespace vggtcd
