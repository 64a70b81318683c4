// SPDX-License-Identifier: Apache-2.0
// Normal equations of surface pairs whose errors are common to whole photos.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "vggtcd/registration/small_similarity.h"
#include "vggtcd/registration/surface_pairs.h"

namespace vggtcd {

// A place known from both epochs, the one of T1 already mapped into T2, all in T2.
struct PointPair {
  Eigen::Vector3d moving = Eigen::Vector3d::Zero(), fixed = Eigen::Vector3d::Zero();
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();  // of moving - fixed
  int32_t frame_t1 = 0, frame_t2 = 0;
};

// What the pairs say about the photos' own similarities b, each about its centre, where theta is
// the similarity of the moving cloud: b given theta is normal with mean + response * theta and this
// covariance. Stacked are the 7 parameters of T1's photos, then T2's; many photos are gathered into
// groups of neighbours.
struct PhotoErrors {
  std::vector<Eigen::Vector3d> centers;  // of the groups, T1's first
  int groups_t1 = 0;
  int frames_t1 = 0, frames_t2 = 0;
  Eigen::VectorXd mean;
  Eigen::MatrixXd response;    // [7 groups, 7]
  Eigen::MatrixXd covariance;  // of photo_errors; else empty

  size_t group_of_t1(size_t frame) const;
  size_t group_of_t2(size_t frame) const;
  // How far the photos' own errors, given theta, move the difference of a pair: J (b_i - b_j).
  Eigen::Vector3d displacement(const PointPair& pair, const Vector7& theta) const;
};

struct SurfaceEquations {
  Matrix7 information = Matrix7::Zero();
  Vector7 gradient = Vector7::Zero();
  double relative_sigma = 0;  // robust standard deviation of a residual, per depth of its pair
  std::optional<PhotoErrors> photos;  // with a frame spread
};

// Tukey's weight in [0, 1] and his loss scaled to end at 1, at 95 % efficiency.
double tukey_weight(double residual, double sigma);
double tukey_loss(double residual, double sigma);

// Linearises sum w r^2 / (sigma depth)^2 over r = n . (moving - fixed) in the seven parameters of
// the moving cloud about `pivot`: a residual's deviation grows with the depth of its pair. With a
// frame spread every photo of both epochs has a small similarity of its own about the centre of its
// pairs, r = J (theta + b_i - b_j), b ~ N(0, spread), and the b are marginalised: then a photo
// counts as one witness that may err, not as thousands of independent points. Without (nullptr) the
// pairs are independent. A pair found in both directions is the same evidence twice, so each counts
// half. sigma is at least min_relative_sigma. Points are added as r^T information r with
// r = moving - fixed in the same model.
SurfaceEquations surface_equations(const std::vector<SurfacePair>& pairs,
                                   std::span<const PointPair> points, const Eigen::Vector3d& pivot,
                                   const FrameSpread* frame_spread, double min_relative_sigma);

// The photos' own errors in the same model.
PhotoErrors photo_errors(const std::vector<SurfacePair>& pairs, std::span<const PointPair> points,
                         const Eigen::Vector3d& pivot, const FrameSpread& frame_spread,
                         double min_relative_sigma);

}  // namespace vggtcd
