// SPDX-License-Identifier: Apache-2.0
// From model units to metres: by lengths that are known, or by cameras whose positions are known.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "vggtcd/geometry/sim3.h"

namespace vggtcd {

// The distance of two points of the T2 frame, as reconstructed and as it is.
struct KnownLength {
  double length_u = 0;  // > 0
  double length_m = 0;  // > 0
};

struct MetricFrame {
  Sim3 metres_from_t2;  // by lengths: a scaling about T2's origin; by cameras: into their frame
  // Standard deviations. Of the scale, relative; nothing where one length says nothing about it.
  std::optional<double> scale_sigma;
  double rotation_sigma_rad = 0;  // about the worst axis; by cameras only
  double position_sigma_m = 0;    // of the middle of the cameras; by cameras only
  double rms_residual_m = 0;
  std::vector<double> residuals_m;  // lengths: as reconstructed less as known; cameras: distance
};

// Minimises sum (s l_i - m_i)^2, for the end points of all lengths are equally uncertain:
// s = sum l m / sum l^2. The variance of s is that of the residuals (n - 1 degrees of freedom), but
// not less than what the end points' own uncertainty point_sigma_u makes of it (0: not known),
// over sum l^2. Throws Error{kDegenerate} if a length differs by more than a quarter from what the
// others say: one of them was measured or typed wrong.
MetricFrame metric_frame_from_lengths(std::span<const KnownLength> lengths, double point_sigma_u);

// Umeyama's similarity of camera centres in T2 onto their known positions, and its uncertainty from
// the residuals (3 n - 7 degrees of freedom). Throws Error{kDegenerate} if fewer than three
// cameras, or cameras on one line, do not determine it, and if the two sets do not have one shape
// (residuals above a fifth of their spread).
MetricFrame metric_frame_from_cameras(std::span<const Eigen::Vector3d> centers_in_t2,
                                      std::span<const Eigen::Vector3d> centers_m);

}  // namespace vggtcd
