// SPDX-License-Identifier: Apache-2.0
// Robust registration: all seven parameters from the static surfaces of both epochs, held near the
// initial similarity by its own uncertainty.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "vggtcd/core/options.h"
#include "vggtcd/geometry/sim3.h"
#include "vggtcd/scene/oriented_points.h"

namespace vggtcd {

struct RobustOptions {
  int robust_grid_resolution = 200;  // voxels along the largest axis of a cloud; >= 1
  double static_distance = 3.0;      // gate on the pair distance, in medians of it; > 0
  double min_normal_cosine = 0.8;    // gate on the normals of a pair, in [0, 1)
  double prior_sigma =
      0.02;  // of the initial similarity: rotation (rad), log scale, translation / extent
  int max_iterations = 40;  // >= 1
  int64_t min_pairs = 200;  // fewer gated pairs keep the initial similarity; >= 7

  static constexpr auto fields = [](auto&& self, auto&& field) {
    field("robust_grid_resolution", self.robust_grid_resolution,
          "Robust: voxels along the largest axis of the cloud.");
    field("static_distance", self.static_distance,
          "Robust: pairs farther apart than this many medians are taken for change.");
    field("min_normal_cosine", self.min_normal_cosine,
          "Robust: pairs whose surface normals disagree more than this are left out.");
    field("prior_sigma", self.prior_sigma,
          "Robust: how far the initial similarity is trusted: standard deviation of its rotation "
          "(rad), its "
          "log scale, and its translation as a share of the scene extent.");
    field("max_iterations", self.max_iterations, "Robust: Gauss-Newton iterations at most.");
    field("min_pairs", self.min_pairs,
          "Robust: with fewer static pairs the initial alignment is kept.");
  };
  void validate() const;
};

// A small similarity about a pivot, in the T2 frame: x -> pivot + exp(s) Exp(w) (x - pivot) + t.
// Order of the seven: w (rad, 3), t (T2 units, 3), s.
using Vector7 = Eigen::Matrix<double, 7, 1>;
using Matrix7 = Eigen::Matrix<double, 7, 7>;

inline constexpr std::array<std::string_view, 7> kDegreesOfFreedom = {
    "rotation_x",    "rotation_y",    "rotation_z", "translation_x",
    "translation_y", "translation_z", "scale"};

Sim3 small_similarity(const Vector7& parameters, const Eigen::Vector3d& pivot);
// Its inverse: the parameters of a similarity about the pivot (rotation below pi).
Vector7 similarity_parameters(const Sim3& similarity, const Eigen::Vector3d& pivot);

enum class RobustVerdict {
  kRefined,
  kKeptInitialFewPairs,   // not enough static surface
  kKeptInitialNotBetter,  // the robust cost did not fall
};
std::span<const EnumName<RobustVerdict>> enum_names(RobustVerdict);

struct RobustResult {
  Sim3 t2_from_t1;
  RobustVerdict verdict = RobustVerdict::kKeptInitialFewPairs;
  std::string explanation;

  Eigen::Vector3d pivot_in_t2 = Eigen::Vector3d::Zero();
  double extent_u = 0;  // robust extent of T2's points
  // Of the seven parameters about the pivot. Errors of a network are common to a whole frame, so
  // the pairs of one frame count as one witness (cluster-robust), not as thousands.
  Matrix7 covariance = Matrix7::Zero();
  // Per degree of freedom, 0 to 1: the share of what is known about it that comes from the static
  // surfaces (the rest is the initial similarity). A plane leaves two translations, a rotation and
  // the scale near 0.
  Vector7 constrained_share = Vector7::Zero();
  std::vector<std::string> weak_directions;  // in words, for shares below 0.5 in any combination

  int iterations = 0;
  int64_t pairs = 0;  // static pairs in the last iteration, both directions
  int64_t points_t1 = 0, points_t2 = 0;
  int64_t rejected_far = 0, rejected_normal = 0;
  double residual_sigma_u = 0;  // robust standard deviation of the point-to-plane residuals
  double effective_pairs = 0;   // pairs / design effect of the clusters
  double cost_initial = 0, cost_final = 0;  // surface_cost with the final scale
};

// Gauss-Newton on r = n . (T x - y) over the nearest pairs in both directions, Tukey weights, gates
// on distance and normals, prior on T T0^-1.
RobustResult align_robust(const OrientedPoints& t1, const OrientedPoints& t2,
                          const Sim3& initial_t2_from_t1, const RobustOptions& options);

// What candidates are compared by: the mean over both directions of the Tukey loss (0 to 1) of the
// point-to-plane distance at scale sigma_u; points without a compatible partner count 1.
double surface_cost(const OrientedPoints& t1, const OrientedPoints& t2, const Sim3& t2_from_t1,
                    double sigma_u, double min_normal_cosine);

}  // namespace vggtcd
