// SPDX-License-Identifier: Apache-2.0
// Tie points: places that two photos show, of either epoch, recognised by what they look like and
// put into space by each photo's own depth.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "vggtcd/geometry/sim3.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

struct PhotoNumber {
  bool of_t1 = true;
  int32_t frame = 0;
};

struct TiePoint {
  PhotoNumber first_photo, second_photo;  // a photo of T1 comes before one of T2
  // The place by either photo, each in its own epoch's frame, with the covariance of a point whose
  // pixel is known well and whose depth is not.
  Eigen::Vector3d first = Eigen::Vector3d::Zero(), second = Eigen::Vector3d::Zero();
  Eigen::Matrix3d first_covariance = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d second_covariance = Eigen::Matrix3d::Zero();

  bool across() const { return first_photo.of_t1 != second_photo.of_t1; }  // the epochs
};

// Of `photos_per_epoch` photos of each epoch (select_keyframes), those pairs that overlap most: of
// both epochs and of one. Key points are compared only where `t2_from_t1`, which may be off by a
// twelfth of the photo's width, expects them. Points without depth, at a step of depth or below the
// 15th percentile of confidence are left out, and pairs of photos with fewer than six ties, which
// may be chance. Still some ties are wrong or on what moved: robust weights are the caller's part.
// In a fixed order; none where photos have no colour or no texture. Throws Error{kDegenerate} if an
// epoch has no depth at all.
std::vector<TiePoint> find_tie_points(const Reconstruction& before, const Reconstruction& after,
                                      const Sim3& t2_from_t1, int photos_per_epoch);

}  // namespace vggtcd
