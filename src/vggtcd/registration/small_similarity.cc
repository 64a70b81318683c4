// SPDX-License-Identifier: Apache-2.0
// Small similarities and their uncertainty: seven parameters about a pivot.
#include "vggtcd/registration/small_similarity.h"

#include <cmath>

namespace vggtcd {

Sim3 small_similarity(const Vector7& parameters, const Eigen::Vector3d& pivot) {
  const Eigen::Vector3d rotation_vector = parameters.segment<3>(0);
  const double angle = rotation_vector.norm();
  Sim3 result;
  result.scale = std::exp(parameters[6]);
  if (angle > 0) {
    result.rotation = Eigen::AngleAxisd(angle, rotation_vector / angle).toRotationMatrix();
  }
  result.translation = pivot + parameters.segment<3>(3) - result.scale * (result.rotation * pivot);
  return result;
}

Vector7 similarity_parameters(const Sim3& similarity, const Eigen::Vector3d& pivot) {
  const Eigen::AngleAxisd rotation(similarity.rotation);
  Vector7 parameters;
  parameters << rotation.angle() * rotation.axis(), similarity * pivot - pivot,
      std::log(similarity.scale);
  return parameters;
}

Matrix7 pivot_change(const Eigen::Vector3d& to_minus_from) {
  Matrix7 change = Matrix7::Identity();
  change.block<3, 7>(3, 0) = point_jacobian(to_minus_from);  // the motion of the new pivot
  return change;
}

Matrix3x7 point_jacobian(const Eigen::Vector3d& arm) {
  // w x d + t + s d, and w x d = -[d]x w.
  const Eigen::Vector3d& d = arm;
  Matrix3x7 jacobian;
  jacobian.leftCols<3>() << 0, d.z(), -d.y(), -d.z(), 0, d.x(), d.y(), -d.x(), 0;
  jacobian.middleCols<3>(3).setIdentity();
  jacobian.col(6) = d;
  return jacobian;
}

Matrix7 FrameSpread::covariance() const {
  Vector7 sigma;
  sigma << Eigen::Vector3d::Constant(rotation_rad), Eigen::Vector3d::Constant(translation_u),
      log_scale;
  return sigma.cwiseAbs2().asDiagonal();
}

}  // namespace vggtcd
