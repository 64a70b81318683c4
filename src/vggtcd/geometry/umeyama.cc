// SPDX-License-Identifier: Apache-2.0
// Umeyama's closed form by the singular value decomposition of the cross-covariance.
#include "vggtcd/geometry/umeyama.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <vector>

#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

constexpr double kMinWeight = 1e-12;       // of the largest
constexpr double kVarianceOffset = 1e-12;  // the reference's; unit squared, so:
constexpr double kMaxOffsetShare = 1e-9;   // of the variance: no unit is so small that it counts

std::vector<double> normalized_weights(std::span<const double> weights, size_t count) {
  std::vector<double> normalized(count, 1.0);
  double largest = 0;
  for (const double weight : weights) {
    check(weight >= 0 && std::isfinite(weight), "umeyama: finite weights >= 0");
    largest = std::max(largest, weight);
  }
  double sum = 0;
  for (size_t i = 0; i < count; ++i) {
    if (largest > 0) normalized[i] = std::max(weights[i], kMinWeight * largest);
    sum += normalized[i];
  }
  for (double& weight : normalized) weight /= sum;
  return normalized;
}

Eigen::Vector3d weighted_mean(std::span<const Eigen::Vector3d> points,
                              const std::vector<double>& weights) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (size_t i = 0; i < points.size(); ++i) {
    check(points[i].allFinite(), "umeyama: finite points");
    mean += weights[i] * points[i];
  }
  return mean;
}

// sum w |p - mean|^2, and the largest coordinate, against which a spread is rounding noise or not.
struct Spread {
  double variance = 0;
  double magnitude = 0;

  Spread(std::span<const Eigen::Vector3d> points, const std::vector<double>& weights,
         const Eigen::Vector3d& mean) {
    for (size_t i = 0; i < points.size(); ++i) {
      variance += weights[i] * (points[i] - mean).squaredNorm();
      magnitude = std::max(magnitude, points[i].cwiseAbs().maxCoeff());
    }
  }
  // Double precision cannot tell these points apart: a few units in the last place.
  bool is_one_point() const { return std::sqrt(variance) <= 1e-14 * magnitude; }
};

UmeyamaStatus status_of(const UmeyamaResult& result, double min_ratio) {
  if (result.rank < 1) return UmeyamaStatus::kCoincident;
  if (result.rank < 2) return UmeyamaStatus::kCollinear;
  const Eigen::Vector3d& d = result.singular_values;
  if (result.reflected && d(1) - d(2) <= min_ratio * d(0)) return UmeyamaStatus::kAmbiguousMirror;
  return UmeyamaStatus::kUnique;
}

}  // namespace

std::string_view describe(UmeyamaStatus status) {
  switch (status) {
    case UmeyamaStatus::kUnique:
      return "the points determine the similarity";
    case UmeyamaStatus::kTooFewPoints:
      return "fewer than 3 points do not determine a similarity";
    case UmeyamaStatus::kCoincident:
      return "the points coincide, so rotation and scale are undetermined";
    case UmeyamaStatus::kCollinear:
      return "the points lie on a line, so the rotation about it is undetermined";
    case UmeyamaStatus::kAmbiguousMirror:
      return "the point sets mirror each other and two rotations fit equally well";
  }
  check(false, "describe: unknown UmeyamaStatus");
  return {};
}

UmeyamaResult umeyama(std::span<const Eigen::Vector3d> x, std::span<const Eigen::Vector3d> y,
                      std::span<const double> weights, const UmeyamaOptions& options) {
  check(x.size() == y.size(), "umeyama: as many x as y");
  check(weights.empty() || weights.size() == x.size(), "umeyama: one weight per pair");
  UmeyamaResult result;
  if (x.size() < 3) return result;

  const std::vector<double> w = normalized_weights(weights, x.size());
  const Eigen::Vector3d mean_x = weighted_mean(x, w), mean_y = weighted_mean(y, w);
  const Spread spread_x(x, w, mean_x), spread_y(y, w, mean_y);
  if (spread_x.is_one_point() || spread_y.is_one_point()) {
    result.status = UmeyamaStatus::kCoincident;
    return result;
  }
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (size_t i = 0; i < x.size(); ++i) {
    covariance += w[i] * (y[i] - mean_y) * (x[i] - mean_x).transpose();
  }
  check(covariance.allFinite(), "umeyama: squares of the coordinates overflow");
  // Of dynamic size: in the fixed-size one g++ 12 sees uninitialised values on the path for NaN.
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(covariance,
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d d = svd.singularValues();
  result.singular_values = d;
  const double floor = options.min_singular_value_ratio * d(0);
  // Uncorrelated sets have a covariance far below the product of their spreads: no rotation in it.
  const bool any = d(0) > 1e-14 * std::sqrt(spread_x.variance * spread_y.variance);
  result.rank = any ? static_cast<int>((d.array() > floor).count()) : 0;
  result.reflected = svd.matrixU().determinant() * svd.matrixV().determinant() < 0;
  result.status = status_of(result, options.min_singular_value_ratio);
  if (result.rank == 0) return result;

  const Eigen::Vector3d sign(1, 1, result.reflected ? -1 : 1);
  Sim3& sim3 = result.y_from_x;
  sim3.rotation = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
  const double offset = std::min(kVarianceOffset, kMaxOffsetShare * spread_x.variance);
  sim3.scale = options.with_scale ? d.dot(sign) / (spread_x.variance + offset) : 1.0;
  sim3.translation = mean_y - sim3.scale * (sim3.rotation * mean_x);
  double sum = 0;
  for (size_t i = 0; i < x.size(); ++i) sum += w[i] * (y[i] - sim3 * x[i]).squaredNorm();
  result.rms = std::sqrt(sum);
  return result;
}

}  // namespace vggtcd
