// SPDX-License-Identifier: Apache-2.0
// Normal equations of surface pairs whose errors are common to whole photos.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "vggtcd/registration/small_similarity.h"
#include "vggtcd/registration/surface_pairs.h"

namespace vggtcd {

struct SurfaceEquations {
  Matrix7 information = Matrix7::Zero();
  Vector7 gradient = Vector7::Zero();
  double sigma_u = 0;  // robust standard deviation of the residuals
};

// Tukey's weight in [0, 1] and his loss scaled to end at 1, at 95 % efficiency.
double tukey_weight(double residual, double sigma);
double tukey_loss(double residual, double sigma);

// Linearises sum w r^2 / sigma^2 over r = n . (moving - fixed) in the seven parameters of the
// moving cloud about `pivot`. With a frame spread every photo of both epochs has a small similarity
// of its own about the centre of its pairs, r = J (theta + b_i - b_j), b ~ N(0, spread), and the b
// are marginalised: then a photo counts as one witness that may err, not as thousands of
// independent points. Without (nullptr) the pairs are independent. A pair found in both directions
// is the same evidence twice, so each counts half.
SurfaceEquations surface_equations(const std::vector<SurfacePair>& pairs,
                                   const Eigen::Vector3d& pivot, const FrameSpread* frame_spread,
                                   double min_sigma_u);

}  // namespace vggtcd
