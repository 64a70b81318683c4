// SPDX-License-Identifier: Apache-2.0
// From model units to metres.
#include "vggtcd/registration/metric_frame.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "vggtcd/core/error.h"
#include "vggtcd/geometry/umeyama.h"

namespace vggtcd {
namespace {

constexpr double kMaxDisagreement = 0.25;  // of a length: beyond it is a mistake, not noise
constexpr double kMaxResidualShare = 0.2;  // of the cameras' spread
constexpr double kMaxRotationSigma = 0.2;  // rad: cameras that leave more are on one line
constexpr double kSimilarityParameters = 7;

double root_mean_square(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value * value;
  return std::sqrt(sum / static_cast<double>(values.size()));
}

Eigen::Vector3d mean_of(std::span<const Eigen::Vector3d> points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& x : points) sum += x;
  return sum / static_cast<double>(points.size());
}

}  // namespace

MetricFrame metric_frame_from_lengths(std::span<const KnownLength> lengths, double point_sigma_u) {
  check(!lengths.empty(), "metric_frame_from_lengths: at least one length");
  double ll = 0, lm = 0;
  for (const KnownLength& known : lengths) {
    check(known.length_u > 0 && known.length_m > 0, "metric_frame_from_lengths: positive lengths");
    ll += known.length_u * known.length_u;
    lm += known.length_u * known.length_m;
  }
  MetricFrame frame;
  const double scale = frame.metres_from_t2.scale = lm / ll;
  for (const KnownLength& known : lengths) {
    const double residual = scale * known.length_u - known.length_m;
    frame.residuals_m.push_back(residual);
    if (std::abs(residual) > kMaxDisagreement * known.length_m) {
      throw_error(ErrorCode::kDegenerate,
                  "known distances contradict each other: together they say {:.3g} m for the one "
                  "given as {:.3g} m; look for a mistyped number or a pixel beside its mark",
                  scale * known.length_u, known.length_m);
    }
  }
  frame.rms_residual_m = root_mean_square(frame.residuals_m);
  // A length errs by both of its ends.
  double variance = 2 * scale * scale * point_sigma_u * point_sigma_u;
  const double n = static_cast<double>(lengths.size());
  if (n > 1) {
    variance = std::max(variance, n * frame.rms_residual_m * frame.rms_residual_m / (n - 1));
  }
  if (variance > 0 || n > 1) frame.scale_sigma = std::sqrt(variance / ll) / scale;
  return frame;
}

MetricFrame metric_frame_from_cameras(std::span<const Eigen::Vector3d> centers_in_t2,
                                      std::span<const Eigen::Vector3d> centers_m) {
  const UmeyamaResult fit = umeyama(centers_in_t2, centers_m);
  if (!fit.determined()) {
    throw_error(ErrorCode::kDegenerate,
                "reference cameras: expected at least 3 that are not on one line, found {} of "
                "which {}; add cameras, or give --known-distance",
                centers_m.size(), describe(fit.status));
  }
  MetricFrame frame;
  frame.metres_from_t2 = fit.y_from_x;
  frame.rms_residual_m = fit.rms;
  const Eigen::Vector3d middle = mean_of(centers_m);
  double spread = 0;
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();  // sum of [a]x^T [a]x
  for (size_t i = 0; i < centers_m.size(); ++i) {
    // The arms are those of the fitted cameras: the noise of measured ones would pass for width.
    const Eigen::Vector3d fitted = fit.y_from_x * centers_in_t2[i];
    frame.residuals_m.push_back((fitted - centers_m[i]).norm());
    const Eigen::Vector3d arm = fitted - middle;
    spread += arm.squaredNorm();
    inertia += arm.squaredNorm() * Eigen::Matrix3d::Identity() - arm * arm.transpose();
  }
  const double n = static_cast<double>(centers_m.size());
  if (fit.rms > kMaxResidualShare * std::sqrt(spread / n)) {
    throw_error(ErrorCode::kDegenerate,
                "reference cameras do not fit the reconstruction: {:.3g} m are left (root mean "
                "square of {} cameras) of {:.3g} m that they spread; look for names that were "
                "swapped, other units, or left-handed axes",
                fit.rms, centers_m.size(), std::sqrt(spread / n));
  }
  const double variance = n * fit.rms * fit.rms / (3 * n - kSimilarityParameters);
  frame.scale_sigma = std::sqrt(variance / spread);
  frame.position_sigma_m = std::sqrt(variance / n);
  const double least =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(inertia).eigenvalues().minCoeff();
  frame.rotation_sigma_rad = std::sqrt(variance / least);
  if (!(frame.rotation_sigma_rad < kMaxRotationSigma)) {
    throw_error(ErrorCode::kDegenerate,
                "reference cameras lie too nearly on one line: the rotation about it stays "
                "uncertain by {:.0f} degrees; add cameras beside the line, or give "
                "--known-distance",
                std::min(180.0, frame.rotation_sigma_rad * 180 / M_PI));
  }
  return frame;
}

}  // namespace vggtcd
