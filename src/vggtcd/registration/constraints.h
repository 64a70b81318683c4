// SPDX-License-Identifier: Apache-2.0
// How well what is static holds each degree of freedom of a similarity, and what they leave open,
// in words.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "vggtcd/registration/small_similarity.h"
#include "vggtcd/registration/surface_pairs.h"

namespace vggtcd {

struct Constraints {
  Matrix7 covariance = Matrix7::Zero();  // of the seven parameters: surfaces and prior together
  // Per parameter, 0 to 1: the share of what is known about it that comes from the surfaces: one
  // minus the ratio of variances.
  Vector7 constrained_share = Vector7::Zero();
  // Independent motions of which the surfaces tell less than half; a plane leaves four.
  int open_degrees_of_freedom = 0;
  // They in words, without a unit, in the frame of the parameters: "sliding along (1.00, 0.00,
  // 0.00)", "turning about (0.00, 0.00, 1.00) through (0.5, 0, 5)". One text may stand for several
  // degrees of freedom ("sliding across (0.00, 0.00, 1.00)": two).
  std::vector<std::string> open_motions;
};

// Normals are noisy, and noise alone makes a plane seem to hold what it does not: with an error e
// of the normal, sliding along the plane changes n . (x - y) by e, in square and sum like geometry.
// The two normals of a pair err independently, so the sum of J_1 J_2^T is that of the geometry
// alone, where the sum of J J^T is that of both. Returns the information with each direction
// reduced by the share of the two that geometry has there, to nothing where that is below a tenth.
Matrix7 without_normal_noise(const Matrix7& surface_information,
                             const std::vector<SurfacePair>& pairs, const Eigen::Vector3d& pivot);

// The information is that of the surfaces about the seven parameters at `pivot`, the covariance the
// prior's about the same. The open motions are the eigenvectors of posterior over prior covariance
// above one half; they span a space that is taken apart into slides, turns about one centre, and
// growth about it. Words name centres in the world that the frame's origin lies in.
Constraints constraints_of(const Matrix7& surface_information, const Matrix7& prior_covariance,
                           const Eigen::Vector3d& pivot,
                           const Eigen::Vector3d& origin_in_world = Eigen::Vector3d::Zero());

}  // namespace vggtcd
