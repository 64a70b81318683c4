// SPDX-License-Identifier: Apache-2.0
// One photo of an epoch against one of the other, aligned once more: what is left of their poses',
// scales' and the registration's errors is estimated on the surfaces that agree, and removed.
#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "vggtcd/change/depth_windows.h"
#include "vggtcd/geometry/pinhole.h"
#include "vggtcd/geometry/rigid3.h"

namespace vggtcd {

struct PairAlignmentOptions {
  double prior_rotation_rad = 0.01;  // standard deviations of what there is to remove: rotation,
  double prior_translation = 0.01;   // translation (share of the scene extent)
  double prior_log_scale = 0.02;     // and scale
  int iterations = 4;
};

// A photo of the other epoch, depth in T2 units.
struct WitnessPhoto {
  Rigid3 camera_from_t2;
  Pinhole pinhole;
  DepthWindows windows;
};

struct PairAlignment {
  // x_in_camera = matrix * x_in_t2 + offset: the pose with the correction in it; its z is the depth
  // to be compared with the photo's.
  Eigen::Matrix3d matrix;
  Eigen::Vector3d offset;
  double gap_sigma = 0;  // robust sigma of the relative gaps (depth / z - 1) that are left
  int samples = 0;       // points on smooth surface that agree within the gate
};

// Gauss-Newton with Tukey weights on the relative depth gaps of `points` (T2) on smooth surface in
// the photo, over a small similarity about its camera: p + w x p + t + s p. gate: gaps beyond it
// are change, not error. With fewer than 50 samples nothing is corrected and gap_sigma is gate / 4.
PairAlignment align_pair(std::span<const Eigen::Vector3f> points, const WitnessPhoto& photo,
                         double gate, double scene_extent_u, const PairAlignmentOptions& options);

// How far a photo sees beyond a point of smooth surface.
struct SurfaceGap {
  size_t point = 0;  // index
  double gap = 0;    // relative: depth / z - 1
  double slope = 0;  // of the gap by the logarithm of the point's distance from where it was seen
};

// The gaps of those points that fall on smooth surface in the photo; center (T2): where the points
// were seen from.
std::vector<SurfaceGap> surface_gaps(std::span<const Eigen::Vector3f> points,
                                     const Eigen::Vector3d& center, const WitnessPhoto& photo,
                                     const PairAlignment& pair);

}  // namespace vggtcd
