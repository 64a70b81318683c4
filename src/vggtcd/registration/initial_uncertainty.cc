// SPDX-License-Identifier: Apache-2.0
// How far the initial similarity and each photo may be off, measured on the keyframes that the
// coarse stage rests on.
#include "vggtcd/registration/initial_uncertainty.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

constexpr double kParametersOfAFit = 7;  // taken from the offsets' freedom, per epoch

// Whether the equations leave a motion open. Turns, shifts and growth have different units, so each
// parameter counts in units of its own diagonal.
bool is_singular(const Matrix7& information) {
  constexpr double kSingular = 1e-9;
  const Vector7 diagonal = information.diagonal();
  if (!(diagonal.minCoeff() > 0)) return true;
  const Vector7 unit = diagonal.cwiseSqrt().cwiseInverse();
  const Eigen::LDLT<Matrix7> solver(unit.asDiagonal() * information * unit.asDiagonal());
  return !(solver.vectorD().minCoeff() > kSingular * solver.vectorD().maxCoeff());
}

bool usable(const KeyframeWitness& witness) { return witness.information(3, 3) > 0; }

// The covariance of an epoch's fit about `pivot`, in the joint frame.
Matrix7 fit_covariance(std::span<const KeyframeWitness> witnesses, const Matrix7& frame_covariance,
                       const Eigen::Vector3d& pivot) {
  Matrix7 information = Matrix7::Zero(), scatter = Matrix7::Zero();
  for (const KeyframeWitness& witness : witnesses) {
    const Matrix7 at_center = pivot_change(witness.center - pivot);
    const Matrix7 gain = at_center.transpose() * witness.information;
    information += gain * at_center;
    scatter += gain * frame_covariance * gain.transpose();
  }
  const Matrix7 inverse = information.inverse();
  return inverse * scatter * inverse;
}

}  // namespace

KeyframeWitness keyframe_witness(std::span<const Eigen::Vector3d> mapped,
                                 std::span<const Eigen::Vector3d> targets,
                                 std::span<const double> weights) {
  check(mapped.size() == targets.size() && mapped.size() == weights.size(),
        "keyframe_witness: one target and one weight per point");
  KeyframeWitness witness;
  if (mapped.size() < 3) return witness;
  double total = 0;
  for (size_t i = 0; i < mapped.size(); ++i) {
    witness.center += weights[i] * mapped[i];
    total += weights[i];
  }
  witness.center /= total;
  Vector7 right_side = Vector7::Zero();
  for (size_t i = 0; i < mapped.size(); ++i) {
    const Matrix3x7 jacobian = point_jacobian(mapped[i] - witness.center);
    witness.information += weights[i] * jacobian.transpose() * jacobian;
    right_side += weights[i] * jacobian.transpose() * (targets[i] - mapped[i]);
  }
  if (is_singular(witness.information)) return {};
  witness.offset = Eigen::LDLT<Matrix7>(witness.information).solve(right_side);
  return witness;
}

InitialUncertainty coarse_uncertainty(std::span<const KeyframeWitness> t1,
                                      std::span<const KeyframeWitness> t2,
                                      const Sim3& joint_from_t2) {
  std::vector<KeyframeWitness> of[2];
  std::copy_if(t1.begin(), t1.end(), std::back_inserter(of[0]), usable);
  std::copy_if(t2.begin(), t2.end(), std::back_inserter(of[1]), usable);
  InitialUncertainty result;
  if (of[0].size() < 2 || of[1].size() < 2) return result;

  double rotation = 0, translation = 0, scale = 0, parameters = 0;
  Eigen::Vector3d pivot = Eigen::Vector3d::Zero();
  for (const auto& witnesses : of) {
    parameters += 7 * static_cast<double>(witnesses.size()) - kParametersOfAFit;
    for (const KeyframeWitness& witness : witnesses) {
      rotation += witness.offset.segment<3>(0).squaredNorm();
      translation += witness.offset.segment<3>(3).squaredNorm();
      scale += witness.offset[6] * witness.offset[6];
      pivot += witness.center / static_cast<double>(of[0].size() + of[1].size());
    }
  }
  const double frames = parameters / 7;  // what is left of the keyframes after the two fits
  const FrameSpread in_joint{std::sqrt(rotation / (3 * frames)),
                             std::sqrt(translation / (3 * frames)), std::sqrt(scale / frames)};
  const Matrix7 covariance = fit_covariance(of[0], in_joint.covariance(), pivot) +
                             fit_covariance(of[1], in_joint.covariance(), pivot);

  // From the joint frame into T2: axes turn, lengths scale.
  const Sim3 t2_from_joint = joint_from_t2.inverse();
  Matrix7 change = Matrix7::Identity();
  change.block<3, 3>(0, 0) = t2_from_joint.rotation;
  change.block<3, 3>(3, 3) = t2_from_joint.scale * t2_from_joint.rotation;
  result.similarity = {change * covariance * change.transpose(), t2_from_joint * pivot};
  result.frame = {in_joint.rotation_rad / std::numbers::sqrt2,
                  in_joint.translation_u * t2_from_joint.scale / std::numbers::sqrt2,
                  in_joint.log_scale / std::numbers::sqrt2};
  return result;
}

}  // namespace vggtcd
