// SPDX-License-Identifier: Apache-2.0
// Robust registration: all seven parameters from the static surfaces of both epochs, held near the
// initial similarity by its own uncertainty.
#include "vggtcd/registration/robust.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "vggtcd/core/parallel.h"
#include "vggtcd/geometry/robust_extent.h"
#include "vggtcd/registration/camera_fit.h"
#include "vggtcd/registration/constraints.h"
#include "vggtcd/registration/frame_equations.h"
#include "vggtcd/registration/surface_pairs.h"

namespace vggtcd {
namespace {

// Of larger clouds every n-th point searches until the iteration has converged on those, about this
// many; then all do, until it has converged again. The last iterations are kept for all.
constexpr int64_t kSearchingPoints = 100'000;
constexpr int kLastIterations = 2;
// A step this small in standard deviations of the result ends the iteration.
constexpr double kConvergedStep = 0.1;
// Residuals are never believed to be smaller than this share of the depth: on data without noise
// the rounding of float positions would otherwise count as information.
constexpr double kSigmaFloor = 1e-4;

struct Rejected {
  int64_t far = 0;
  int64_t normal = 0;
};

// The gates: near in medians of the distance, and surfaces that face the same way. Leaves the
// static pairs, in their order.
Rejected keep_static(std::vector<SurfacePair>& pairs, const RobustOptions& options) {
  const double limit = options.static_distance *
                       median_over(pairs, [](const SurfacePair& pair) { return pair.distance; });
  const auto size = static_cast<int64_t>(pairs.size());
  constexpr int64_t kGrain = 1 << 14;
  std::vector<Rejected> rejected(static_cast<size_t>(num_chunks(size, kGrain)));
  const auto at = [&](int64_t i) { return pairs.begin() + i; };
  parallel_for(size, kGrain, [&](int64_t begin, int64_t end) {  // each chunk to its own front
    Rejected& of_chunk = rejected[static_cast<size_t>(begin / kGrain)];
    std::remove_if(at(begin), at(end), [&](const SurfacePair& pair) {
      const bool far = pair.distance > limit;
      const bool turned = !far && pair.normal_cosine < options.min_normal_cosine;
      of_chunk.far += far ? 1 : 0;
      of_chunk.normal += turned ? 1 : 0;
      return far || turned;
    });
  });
  Rejected all;
  auto kept = pairs.begin();
  for (int64_t begin = 0; begin < size; begin += kGrain) {
    const Rejected& of_chunk = rejected[static_cast<size_t>(begin / kGrain)];
    const int64_t end = std::min(size, begin + kGrain) - of_chunk.far - of_chunk.normal;
    kept = kept == at(begin) ? at(end) : std::move(at(begin), at(end), kept);
    all.far += of_chunk.far;
    all.normal += of_chunk.normal;
  }
  pairs.erase(kept, pairs.end());
  return all;
}

double cost_of(const std::vector<SurfacePair>& all, double relative_sigma,
               double min_normal_cosine) {
  if (all.empty()) return 1;
  const auto size = static_cast<int64_t>(all.size());
  constexpr int64_t kGrain = 1 << 14;
  std::vector<double> sums(static_cast<size_t>(num_chunks(size, kGrain)), 0);
  parallel_for(size, kGrain, [&](int64_t begin, int64_t end) {
    double& sum = sums[static_cast<size_t>(begin / kGrain)];
    for (const SurfacePair& pair :
         std::span(all).subspan(static_cast<size_t>(begin), static_cast<size_t>(end - begin))) {
      // The nearest point may lie beside the surface rather than on it, by up to the voxel size;
      // what matters is the distance to its plane, and that it is not far away altogether.
      const bool compatible = pair.normal_cosine >= min_normal_cosine;
      const double along = 0.25 * pair.distance;
      const double residual = std::max(std::abs(pair.plane_residual()), along);
      sum += compatible ? tukey_loss(residual, relative_sigma * pair.depth_u) : 1;
    }
  });
  const double sum = std::accumulate(sums.begin(), sums.end(), 0.0);
  return sum / static_cast<double>(all.size());
}

}  // namespace

std::span<const EnumName<RobustVerdict>> enum_names(RobustVerdict) {
  static constexpr EnumName<RobustVerdict> kNames[] = {
      {RobustVerdict::kRefined, "refined"},
      {RobustVerdict::kKeptInitialFewPairs, "kept_initial_few_pairs"},
      {RobustVerdict::kKeptInitialNotBetter, "kept_initial_not_better"}};
  return kNames;
}

void RobustOptions::validate() const {
  check_field(robust_grid_resolution >= 1, "robust_grid_resolution", robust_grid_resolution,
              "at least 1");
  check_field(static_distance > 0, "static_distance", static_distance, "a positive number");
  check_field(min_normal_cosine >= 0 && min_normal_cosine < 1, "min_normal_cosine",
              min_normal_cosine, "a number in [0, 1)");
  check_field(prior_sigma > 0, "prior_sigma", prior_sigma, "a positive number");
  check_field(frame_sigma > 0, "frame_sigma", frame_sigma, "a positive number");
  check_field(max_iterations >= 1, "max_iterations", max_iterations, "at least 1");
  check_field(min_pairs >= 7, "min_pairs", min_pairs, "at least 7");
}

namespace {

InitialUncertainty assumed_uncertainty(const RobustOptions& options, double extent_u,
                                       const Eigen::Vector3d& pivot) {
  const double prior = options.prior_sigma, frame = options.frame_sigma;
  InitialUncertainty result;
  result.similarity = {FrameSpread{prior, prior * extent_u, prior}.covariance(), pivot};
  result.frame = {frame, frame * extent_u, frame};
  return result;
}

Eigen::Vector3d mean_of(const std::vector<Eigen::Vector3f>& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3f& x : points) sum += x.cast<double>();
  return sum / static_cast<double>(points.size());
}

}  // namespace

RobustResult align_robust(const OrientedPoints& t1, const OrientedPoints& t2,
                          const Sim3& initial_t2_from_t1,
                          const std::optional<InitialUncertainty>& measured,
                          const RobustOptions& options) {
  options.validate();
  RobustResult result;
  result.t2_from_t1 = initial_t2_from_t1;
  result.points_t1 = static_cast<int64_t>(t1.size());
  result.points_t2 = static_cast<int64_t>(t2.size());
  if (result.points_t1 + result.points_t2 < options.min_pairs || t1.size() == 0 || t2.size() == 0) {
    result.explanation = fmt::format(
        "Kept the initial alignment: {} and {} surface points are too few to refine on.", t1.size(),
        t2.size());
    return result;
  }
  result.pivot_in_t2 = mean_of(t2.positions);
  result.extent_u = robust_extent(t2.positions);
  result.uncertainty_measured =
      measured && options.measured_uncertainty && measured->similarity.covariance.trace() > 0;
  result.uncertainty = result.uncertainty_measured
                           ? *measured
                           : assumed_uncertainty(options, result.extent_u, result.pivot_in_t2);
  const Matrix7 prior_covariance = result.uncertainty.similarity.about(result.pivot_in_t2);
  const Matrix7 prior_information = prior_covariance.inverse();

  const SurfaceMatcher matcher(t1, t2, options.relative_depth ? 0 : result.extent_u);
  std::vector<SurfacePair> pairs;
  Sim3 current = initial_t2_from_t1;
  Matrix7 surface_information = Matrix7::Zero();
  int stride = 1;
  if (options.max_iterations > kLastIterations) {
    const int64_t times = (result.points_t1 + result.points_t2) / kSearchingPoints;
    stride = static_cast<int>(std::clamp<int64_t>(times, 1, 1000));
  }
  while (!result.converged && result.iterations < options.max_iterations) {
    ++result.iterations;
    matcher.pairs(current, options.both_directions, stride, pairs);
    const Rejected rejected = keep_static(pairs, options);
    result.pairs = static_cast<int64_t>(pairs.size());
    result.rejected_far = rejected.far;
    result.rejected_normal = rejected.normal;
    if (result.pairs < options.min_pairs && stride > 1) {
      stride = 1;
      continue;
    }
    if (result.pairs < options.min_pairs) {
      result.explanation = fmt::format(
          "Kept the initial alignment: {} static surface pairs are fewer than the {} that a "
          "refinement needs.",
          result.pairs, options.min_pairs);
      return result;
    }
    const SurfaceEquations surface =
        surface_equations(pairs, result.pivot_in_t2,
                          options.frame_errors ? &result.uncertainty.frame : nullptr, kSigmaFloor);
    result.relative_sigma = surface.relative_sigma;
    surface_information = surface.information;

    // The prior's residual is what separates the current from the initial similarity.
    const Vector7 from_initial =
        similarity_parameters(current * initial_t2_from_t1.inverse(), result.pivot_in_t2);
    const Matrix7 information = surface.information + prior_information;
    const Vector7 slope = surface.gradient + prior_information * from_initial;
    const Vector7 step = -information.ldlt().solve(slope);
    current = small_similarity(step, result.pivot_in_t2) * current;
    const bool small = step.dot(information * step) < kConvergedStep * kConvergedStep;
    result.converged = small && stride == 1;
    if (small || result.iterations + kLastIterations >= options.max_iterations) stride = 1;
  }
  result.residual_sigma_u = result.relative_sigma * median_over(pairs, [](const SurfacePair& pair) {
                              return pair.depth_u;
                            });
  const Constraints constraints =
      constraints_of(without_normal_noise(surface_information, pairs, result.pivot_in_t2),
                     prior_covariance, result.pivot_in_t2);
  result.covariance = constraints.covariance;
  result.constrained_share = constraints.constrained_share;
  result.open_degrees_of_freedom = constraints.open_degrees_of_freedom;
  result.open_motions = constraints.open_motions;

  const auto cost_at = [&](const Sim3& t2_from_t1) {
    matcher.pairs(t2_from_t1, true, 1, pairs);
    return cost_of(pairs, result.relative_sigma, options.min_normal_cosine);
  };
  result.cost_initial = cost_at(initial_t2_from_t1);
  result.cost_final = cost_at(current);
  if (result.cost_final >= result.cost_initial) {
    result.verdict = RobustVerdict::kKeptInitialNotBetter;
    result.explanation = fmt::format(
        "Kept the initial alignment: the refined one does not fit the static surfaces better (cost "
        "{:.4g} before, {:.4g} after).",
        result.cost_initial, result.cost_final);
    return result;
  }
  result.verdict = RobustVerdict::kRefined;
  result.t2_from_t1 = current;
  if (options.camera_fit && options.frame_errors) {
    // The cost left the pairs at `current`, in both directions.
    if (!options.both_directions) matcher.pairs(current, false, 1, pairs);
    keep_static(pairs, options);
    const PhotoErrors photos =
        photo_errors(pairs, result.pivot_in_t2, result.uncertainty.frame, kSigmaFloor);
    std::vector<Eigen::Vector3d> cameras_t1 = t1.cameras;
    for (Eigen::Vector3d& camera : cameras_t1) camera = current * camera;
    const CameraFit fit =
        fit_cameras(photos, cameras_t1, t2.cameras, result.pivot_in_t2, result.covariance);
    result.t2_from_t1 = small_similarity(fit.step, result.pivot_in_t2) * current;
    result.covariance = fit.covariance;
  }
  result.explanation = fmt::format(
      "Refined rotation, translation and scale on {} static surface pairs; they fit to {:.3g}.",
      result.pairs, result.residual_sigma_u);
  if (!result.open_motions.empty()) {
    result.explanation += fmt::format(
        " Held by the initial alignment only, not by static surfaces: {} (in the T2 frame).",
        fmt::join(result.open_motions, "; "));
  }
  return result;
}

double surface_cost(const OrientedPoints& t1, const OrientedPoints& t2, const Sim3& t2_from_t1,
                    const RobustResult& scale, const RobustOptions& options) {
  check(scale.relative_sigma > 0, "surface_cost: positive sigma");
  const SurfaceMatcher matcher(t1, t2, options.relative_depth ? 0 : scale.extent_u);
  return cost_of(matcher.pairs(t2_from_t1), scale.relative_sigma, options.min_normal_cosine);
}

}  // namespace vggtcd
