// SPDX-License-Identifier: Apache-2.0
// Robust registration: all seven parameters from tie points between photos and from the static
// surfaces of both epochs, held near the initial similarity by its own uncertainty.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "vggtcd/core/options.h"
#include "vggtcd/geometry/sim3.h"
#include "vggtcd/registration/initial_uncertainty.h"
#include "vggtcd/registration/small_similarity.h"
#include "vggtcd/registration/tie_points.h"
#include "vggtcd/scene/oriented_points.h"

namespace vggtcd {

struct RobustOptions {
  int robust_grid_resolution = 200;  // voxels along the largest axis of a cloud; >= 1
  double static_distance = 3.0;      // gate on the pair distance, in medians of it; > 0
  double min_normal_cosine = 0.8;    // gate on the normals of a pair, in [0, 1)
  bool both_directions = true;       // also search from T2 to T1
  bool measured_uncertainty = true;  // of the initial similarity and of a photo, from the keyframes
  bool frame_errors = true;          // a photo errs as a whole; false: points are independent
  bool relative_depth = true;        // errors grow with the distance from the camera
  bool tie_points = true;            // what photos of both epochs show alike (tie_points.h)
  int tie_photos = 24;               // of each epoch that are searched for them; >= 1
  bool camera_fit = true;            // carry the cameras, not only the surfaces (camera_fit.h)
  // Where nothing is measured: rotation (rad), log scale, translation / extent.
  double prior_sigma = 0.02;   // of the initial similarity; > 0
  double frame_sigma = 0.002;  // of one photo; > 0
  int max_iterations = 30;     // >= 1
  int64_t min_ties = 50;       // fewer tie points are not looked at; >= 7
  int64_t min_pairs = 200;     // fewer gated pairs are not looked at; >= 7

  static constexpr auto fields = [](auto&& self, auto&& field) {
    field("robust_grid_resolution", self.robust_grid_resolution,
          "Robust: voxels along the largest axis of the cloud.");
    field("static_distance", self.static_distance,
          "Robust: pairs farther apart than this many medians are taken for change.");
    field("min_normal_cosine", self.min_normal_cosine,
          "Robust: pairs whose surface normals disagree more than this are left out.");
    field("both_directions", self.both_directions,
          "Robust: pairs from T1 to T2 and from T2 to T1, not only the former.");
    field("measured_uncertainty", self.measured_uncertainty,
          "Robust: how far the initial alignment and each photo may be off is measured on the "
          "keyframes of the joint pass; else, and without a joint pass, it is assumed.");
    field(
        "frame_errors", self.frame_errors,
        "Robust: a photo's points may be misplaced, tilted and scaled as a whole; else all points "
        "are taken for independent.");
    field(
        "relative_depth", self.relative_depth,
        "Robust: points err in proportion to their distance from the camera, in the joint pass as "
        "on the surfaces; else all points alike.");
    field("tie_points", self.tie_points,
          "Robust: places that photos of both epochs show alike hold the alignment besides the "
          "surfaces.");
    field("tie_photos", self.tie_photos,
          "Robust: photos of each epoch that are searched for such places.");
    field("min_ties", self.min_ties,
          "Robust: fewer of them between the epochs are taken for chance.");
    field("camera_fit", self.camera_fit,
          "Robust: the cameras get a similarity of their own, by what their photos show; else the "
          "one that fits the surfaces. Needs frame-errors.");
    field(
        "prior_sigma", self.prior_sigma,
        "Robust: assumed standard deviation of the initial alignment's rotation (rad), log scale, "
        "and translation as a share of the scene extent, where nothing is measured.");
    field("frame_sigma", self.frame_sigma, "Robust: the same of one photo's points.");
    field("max_iterations", self.max_iterations, "Robust: Gauss-Newton iterations at most.");
    field("min_pairs", self.min_pairs,
          "Robust: fewer static pairs are not looked at; without ties the initial alignment is "
          "kept then.");
  };
  void validate() const;
};

enum class RobustVerdict {
  kRefined,
  kNotConverged,          // refined, and better than before, but it did not come to rest
  kKeptInitialFewPairs,   // not enough static surface, and no ties
  kKeptInitialNotBetter,  // the robust cost did not fall
};
std::span<const EnumName<RobustVerdict>> enum_names(RobustVerdict);

enum class CandidateCost { kSurfaces, kTiePoints };
std::span<const EnumName<CandidateCost>> enum_names(CandidateCost);

struct RobustResult {
  // A reconstruction is bent, so two similarities: that which carries the cameras, for trajectories
  // (camera_fit; without it the other one), and that which fits what the photos show, for all that
  // is said about surfaces.
  Sim3 t2_from_t1;
  Sim3 surface_t2_from_t1;
  RobustVerdict verdict = RobustVerdict::kKeptInitialFewPairs;
  std::string explanation;

  Eigen::Vector3d pivot_in_t2 = Eigen::Vector3d::Zero();
  double extent_u = 0;  // robust extent of T2's points
  // Of the seven parameters of t2_from_t1 about the pivot, from surfaces, ties, the photos' own
  // errors, the initial uncertainty, and (with frame_errors) the bend of both passes.
  Matrix7 covariance = Matrix7::Zero();
  Matrix7 surface_covariance = Matrix7::Zero();  // of surface_t2_from_t1, likewise
  // Per degree of freedom, 0 to 1: the share of what is known about it that comes from surfaces and
  // ties (the rest is the initial similarity): one minus the ratio of variances. A plane without
  // ties leaves two translations, a rotation and the scale near 0.
  Vector7 constrained_share = Vector7::Zero();
  // What they leave to the initial similarity, in words (constraints.h).
  int open_degrees_of_freedom = 0;
  std::vector<std::string> open_motions;

  int iterations = 0;
  int64_t pairs = 0;  // static pairs in the last iteration, both directions
  int64_t points_t1 = 0, points_t2 = 0;
  int64_t rejected_far = 0, rejected_normal = 0;
  // Robust standard deviation of the point-to-plane residuals at the median depth, and per depth of
  // the pair, which is what they are weighed by.
  double residual_sigma_u = 0, relative_sigma = 0;
  int64_t ties = 0;                // between the epochs, found
  int64_t ties_used = 0;           // of them, not outliers; 0 if ties were not believed
  bool ties_contradict = false;    // each other: only those count that agree pair of photos by pair
  double tie_deviation = 0;        // of their distances against what they promise
  InitialUncertainty uncertainty;  // what was assumed or measured beforehand
  bool uncertainty_measured = false;
  CandidateCost compared_by = CandidateCost::kSurfaces;
  double tie_variance = 0;  // as tie_deviation^2, with the photos' own errors: scales tie_cost
  bool converged = false;   // the last step was below a tenth of a standard deviation
  double cost_initial = 0, cost_final = 0;  // candidate_cost of the start and the surfaces' fit

  // What a reader of the result should know before believing it; empty: nothing.
  std::vector<std::string> doubts() const;
  bool refined() const {  // the similarities are better than the start
    return verdict == RobustVerdict::kRefined || verdict == RobustVerdict::kNotConverged;
  }
};

// Gauss-Newton over the ties and, once they have converged, the nearest pairs of surfaces, in one
// model in which photos may err as a whole (frame_equations.h): ties with Tukey weights on their
// Mahalanobis distance (tie_weights.h), surfaces with r = n . (T x - y), whose deviation grows with
// depth, Tukey weights and gates on distance and normals, and the initial similarity with its
// uncertainty as prior: the maximum a posteriori. `measured` is what the coarse stage knows about
// itself (coarse_uncertainty); without it prior_sigma and frame_sigma stand in.
RobustResult align_robust(const OrientedPoints& t1, const OrientedPoints& t2,
                          std::span<const TiePoint> ties, const Sim3& initial_t2_from_t1,
                          const std::optional<InitialUncertainty>& measured,
                          const RobustOptions& options);

// What candidates are compared by, 0 to 1: of tie points the mean Tukey loss of their distances
// (tie_cost); without them that of the point-to-plane distances of both directions, where points
// without a compatible partner count 1. `scale` is what align_robust found out about both.
double candidate_cost(const OrientedPoints& t1, const OrientedPoints& t2,
                      std::span<const TiePoint> ties, const Sim3& t2_from_t1,
                      const RobustResult& scale, const RobustOptions& options);

}  // namespace vggtcd
