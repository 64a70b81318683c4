// SPDX-License-Identifier: Apache-2.0
// Umeyama: the similarity that maps one set of points onto another in the least-squares sense, in
// closed form. S. Umeyama, "Least-squares estimation of transformation parameters between two point
// patterns", IEEE PAMI 13(4), 1991. Weights and the two small constants follow the reference Python
// code, but for units of another size than its own.
#pragma once

#include <Eigen/Core>
#include <span>
#include <string_view>

#include "vggtcd/geometry/sim3.h"

namespace vggtcd {

enum class UmeyamaStatus {
  kUnique,          // the data determine all parameters
  kTooFewPoints,    // fewer than 3 points
  kCoincident,      // the points of a set are (nearly) one point: rotation and scale undetermined
  kCollinear,       // the points are (nearly) on a line: rotation about it undetermined
  kAmbiguousMirror  // the sets mirror each other and two axes could be flipped equally well
};

// One sentence for a report.
std::string_view describe(UmeyamaStatus status);

struct UmeyamaOptions {
  bool with_scale = true;  // false: scale is 1

  // Singular values of the cross-covariance below this share of the largest count as zero. They
  // measure squared spreads: 1e-10 is a line that is 1e-5 of its length thick.
  double min_singular_value_ratio = 1e-10;
};

struct UmeyamaResult {
  UmeyamaStatus status = UmeyamaStatus::kTooFewPoints;
  bool determined() const { return status == UmeyamaStatus::kUnique; }

  // Meaningful if determined(). kCollinear and kAmbiguousMirror: one of the equally good solutions.
  // Otherwise the identity.
  Sim3 y_from_x;

  // Of the weighted cross-covariance of y and x, descending: how well the rotation is determined.
  Eigen::Vector3d singular_values = Eigen::Vector3d::Zero();
  int rank = 0;            // singular values that count as non-zero; 3 in general, 2 for a plane
  bool reflected = false;  // a mirroring would fit better than the rotation returned
  double rms = 0;          // weighted root mean square of |y - y_from_x * x|
};

// Minimises sum_i w_i |y_i - (s R x_i + t)|^2 over s, R (a proper rotation) and t:
//   mu = sum w x, S = sum w (y - mu_y)(x - mu_x)^T = U D V^T, R = U diag(1, 1, det(U) det(V)) V^T,
//   s = tr(D diag(1, 1, det(U) det(V))) / (sum w |x - mu_x|^2 + e), t = mu_y - s R mu_x,
// e = 1e-12, but at most 1e-9 of what it is added to: the unit of x does not matter. Weights are
// raised to at least 1e-12 of the largest, then normalised to sum 1; empty, or all zero: all equal.
// x, y and weights have one length and are finite, weights are not negative; Error{kInternal}
// otherwise.
UmeyamaResult umeyama(std::span<const Eigen::Vector3d> x, std::span<const Eigen::Vector3d> y,
                      std::span<const double> weights = {}, const UmeyamaOptions& options = {});

}  // namespace vggtcd
