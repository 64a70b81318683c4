// SPDX-License-Identifier: Apache-2.0
// Tie points: places that a photo of either epoch shows, recognised by what they look like and put
// into space by each photo's own depth.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "vggtcd/geometry/sim3.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

struct TiePoint {
  int32_t frame_t1 = 0, frame_t2 = 0;
  // Each in its own epoch's frame, with the covariance of a point whose pixel is known well and
  // whose depth is not.
  Eigen::Vector3d in_t1 = Eigen::Vector3d::Zero(), in_t2 = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_t1 = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d covariance_t2 = Eigen::Matrix3d::Zero();
};

// Of `photos_per_epoch` photos of each epoch (select_keyframes), those pairs that overlap most.
// Key points are compared only where `t2_from_t1`, which may be off by a twelfth of the photo's
// width, expects them. Points without depth, at a step of depth or below the 15th percentile of
// confidence are left out. Some ties are wrong or on what moved: robust weights are the caller's
// part. In a fixed order; empty if photos have no colour or no texture.
std::vector<TiePoint> find_tie_points(const Reconstruction& before, const Reconstruction& after,
                                      const Sim3& t2_from_t1, int photos_per_epoch);

}  // namespace vggtcd
