// SPDX-License-Identifier: Apache-2.0
// Normal equations of surface pairs and tie points whose errors are common to whole photos.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "vggtcd/registration/small_similarity.h"
#include "vggtcd/registration/surface_pairs.h"
#include "vggtcd/registration/tie_points.h"

namespace vggtcd {

// Two photos' points of one place, all in T2: a point of a photo of T1 is already mapped.
struct PointPair {
  PhotoNumber first_photo, second_photo;
  Eigen::Vector3d first = Eigen::Vector3d::Zero(), second = Eigen::Vector3d::Zero();
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();  // of first - second
};

struct PhotoCounts {
  int32_t t1 = 0, t2 = 0;
};

// The photos of both epochs, T1's first; of more than 48 of an epoch neighbours share a group, for
// they err alike anyway, and it bounds the linear system.
class PhotoGroups {
 public:
  PhotoGroups() = default;
  explicit PhotoGroups(PhotoCounts photos) : photos_(photos) {}
  size_t of(PhotoNumber photo) const;
  size_t of_t1() const { return groups_of(photos_.t1); }
  size_t count() const { return groups_of(photos_.t1) + groups_of(photos_.t2); }

 private:
  static size_t groups_of(int32_t photos);
  PhotoCounts photos_;
};

// What the pairs say about the photos' own similarities b, each about its centre, where theta is
// the similarity of the moving cloud: b given theta is normal with mean + response * theta and this
// covariance. Stacked are the 7 parameters of each group.
struct PhotoErrors {
  PhotoGroups groups;
  std::vector<Eigen::Vector3d> centers;  // of what the groups show
  std::vector<bool> known;               // whether anything was said about the group
  Eigen::VectorXd mean;
  Eigen::MatrixXd response;    // [7 groups, 7]
  Eigen::MatrixXd covariance;  // of photo_errors; else empty

  // How far the photos' own errors, given theta, move first - second: J (b_i - b_j).
  Eigen::Vector3d displacement(const PointPair& pair, const Vector7& theta) const;
};

struct FrameEquations {
  Matrix7 information = Matrix7::Zero();
  Vector7 gradient = Vector7::Zero();
  double relative_sigma = 0;  // robust standard deviation of a residual, per depth of its pair
  std::optional<PhotoErrors> photos;  // with a frame spread
};

// Tukey's weight in [0, 1] and his loss scaled to end at 1, at 95 % efficiency.
double tukey_weight(double residual, double sigma);
double tukey_loss(double residual, double sigma);

// Linearises sum w r^2 / (sigma depth)^2 over r = n . (moving - fixed) in the seven parameters of
// the moving cloud about `pivot`: a residual's deviation grows with the depth of its pair. A pair
// found in both directions is the same evidence twice, so each counts half. Points add
// r^T information r with r = first - second.
// With a frame spread every photo of both epochs has a small similarity of its own about the centre
// of its pairs, r = J (theta + b_i - b_j), b ~ N(0, spread), and the b are marginalised: then a
// photo counts as one witness that may err, not as thousands of independent points; points between
// photos of one epoch say nothing about theta, but about b. And a photo's surface pairs count as 20
// together at most: depth errs in patches. Without (nullptr) pairs and points are independent.
// sigma is at least min_relative_sigma.
FrameEquations frame_equations(const std::vector<SurfacePair>& pairs,
                               std::span<const PointPair> points, PhotoCounts photos,
                               const Eigen::Vector3d& pivot, const FrameSpread* frame_spread,
                               double min_relative_sigma);

// The photos' own errors in the same model, with their covariance.
PhotoErrors photo_errors(const std::vector<SurfacePair>& pairs, std::span<const PointPair> points,
                         PhotoCounts photos, const Eigen::Vector3d& pivot,
                         const FrameSpread& frame_spread, double min_relative_sigma);

}  // namespace vggtcd
