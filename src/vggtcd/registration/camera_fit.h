// SPDX-License-Identifier: Apache-2.0
// From aligned surfaces to aligned cameras: the similarity that carries the cameras of one epoch
// into the other, where photos err as a whole.
#pragma once

#include <Eigen/Core>
#include <span>

#include "vggtcd/registration/frame_equations.h"
#include "vggtcd/registration/small_similarity.h"

namespace vggtcd {

struct CameraFit {
  Vector7 step = Vector7::Zero();        // about the pivot, on top of theta
  Matrix7 covariance = Matrix7::Zero();  // of the step, were photos' errors independent
  // They are not. What this adds: the scatter of the cameras about their epoch's fit, of which each
  // epoch has two independent samples only.
  Matrix7 bend = Matrix7::Zero();
};

// A reconstruction is bent, so the similarity that lays what it shows best onto the other epoch is
// not the one that carries its cameras best; but a camera is tied to what its photo shows. If photo
// i of T1 errs by b_i against the common world, its camera belongs at (theta + b_i) c_i, and c_j of
// T2 at b_j c_j. The answer is theta + S1 - S2, where S_e fits the b of its epoch's photos by least
// squares: at the cameras' centres with weight 1, and with weight kSurfaceWeight over a ball around
// what each photo shows (which keeps the rotation about a straight walk). `cameras_t1` are mapped
// into T2 by theta, whose covariance about the pivot is given. Photos that nothing was said about
// do not count. The bend of an epoch of fewer than four photos is taken from `frame_spread`.
CameraFit fit_cameras(const PhotoErrors& photos, std::span<const Eigen::Vector3d> cameras_t1,
                      std::span<const Eigen::Vector3d> cameras_t2, const Eigen::Vector3d& pivot,
                      const Matrix7& theta_covariance, const FrameSpread& frame_spread);

}  // namespace vggtcd
