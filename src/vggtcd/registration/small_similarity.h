// SPDX-License-Identifier: Apache-2.0
// Small similarities and their uncertainty: seven parameters about a pivot.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <string_view>

#include "vggtcd/geometry/sim3.h"

namespace vggtcd {

// A small similarity about a pivot: x -> pivot + exp(s) Exp(w) (x - pivot) + t.
// Order of the seven: w (rad, 3), t (units of the frame, 3), s.
using Vector7 = Eigen::Matrix<double, 7, 1>;
using Matrix7 = Eigen::Matrix<double, 7, 7>;
using Matrix3x7 = Eigen::Matrix<double, 3, 7>;

inline constexpr std::array<std::string_view, 7> kDegreesOfFreedom = {
    "rotation_x",    "rotation_y",    "rotation_z", "translation_x",
    "translation_y", "translation_z", "scale"};

Sim3 small_similarity(const Vector7& parameters, const Eigen::Vector3d& pivot);
// Its inverse: the parameters of a similarity about the pivot (rotation below pi).
Vector7 similarity_parameters(const Sim3& similarity, const Eigen::Vector3d& pivot);

// First order: the parameters of one motion about two pivots, parameters_about_to = A *
// parameters_about_from, where the pivots differ by to - from.
Matrix7 pivot_change(const Eigen::Vector3d& to_minus_from);

// First order: how a point moves by the seven parameters, where arm = point - pivot.
Matrix3x7 point_jacobian(const Eigen::Vector3d& arm);
// And how far along a normal: normal^T point_jacobian(arm).
inline Vector7 plane_jacobian(const Eigen::Vector3d& arm, const Eigen::Vector3d& normal) {
  Vector7 jacobian;
  jacobian << arm.cross(normal), normal, normal.dot(arm);
  return jacobian;
}

// How far a similarity may be off: covariance about a pivot, both in the target frame.
struct SimilarityCovariance {
  Matrix7 covariance = Matrix7::Zero();
  Eigen::Vector3d pivot = Eigen::Vector3d::Zero();

  Matrix7 about(const Eigen::Vector3d& other_pivot) const {
    const Matrix7 change = pivot_change(other_pivot - pivot);
    return change * covariance * change.transpose();
  }
};

// Standard deviations of one photo's points against the scene, as a similarity about their centre:
// misplaced, tilted and mis-scaled as a whole.
struct FrameSpread {
  double rotation_rad = 0;
  double translation_u = 0;
  double log_scale = 0;

  Matrix7 covariance() const;
};

}  // namespace vggtcd
