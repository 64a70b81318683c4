// SPDX-License-Identifier: Apache-2.0
// Robust registration: all seven parameters from tie points between photos and from the static
// surfaces of both epochs, held near the initial similarity by its own uncertainty.
#include "vggtcd/registration/robust.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/geometry/robust_extent.h"
#include "vggtcd/registration/camera_fit.h"
#include "vggtcd/registration/constraints.h"
#include "vggtcd/registration/frame_equations.h"
#include "vggtcd/registration/surface_pairs.h"
#include "vggtcd/registration/tie_weights.h"

namespace vggtcd {
namespace {

// Of larger clouds only every n-th point searches, about this many together: neighbours say the
// same (frame_equations.cc).
constexpr int64_t kSearchingPoints = 100'000;
// A step this small in standard deviations of the result ends the iteration.
constexpr double kConvergedStep = 0.1;
// Residuals are never believed to be smaller than this share of the depth: on data without noise
// the rounding of float positions would otherwise count as information.
constexpr double kSigmaFloor = 1e-4;
// Ties that are off by five times what they promise, whatever photos err, are chance; so they are
// where less than this share of them agrees with the rest: of random ones a twentieth does.
constexpr double kMaxTieVariance = 25;
constexpr double kMinTiesAgreeing = 0.3;

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

// The mean over both directions of the Tukey loss of the point-to-plane distance; points without a
// compatible partner count 1.
double surface_cost(const SurfaceMatcher& matcher, const Sim3& t2_from_t1, double relative_sigma,
                    const RobustOptions& options) {
  check(relative_sigma > 0, "surface_cost: positive sigma");
  const std::vector<SurfacePair> all = matcher.pairs(t2_from_t1);
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
      const bool compatible = pair.normal_cosine >= options.min_normal_cosine;
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
      {RobustVerdict::kNotConverged, "not_converged"},
      {RobustVerdict::kKeptInitialFewPairs, "kept_initial_few_pairs"},
      {RobustVerdict::kKeptInitialNotBetter, "kept_initial_not_better"}};
  return kNames;
}

std::span<const EnumName<CandidateCost>> enum_names(CandidateCost) {
  static constexpr EnumName<CandidateCost> kNames[] = {{CandidateCost::kSurfaces, "surfaces"},
                                                       {CandidateCost::kTiePoints, "tie_points"}};
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
  check_field(tie_photos >= 1, "tie_photos", tie_photos, "at least 1");
  check_field(min_ties >= 7, "min_ties", min_ties, "at least 7");
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

// What surfaces and ties tell about the similarity: the surfaces' part of it without the noise of
// their normals.
Matrix7 held_information(const Matrix7& information, const std::vector<SurfacePair>& pairs,
                         bool has_ties, PhotoCounts photos, const Eigen::Vector3d& pivot,
                         const FrameSpread* spread) {
  if (!has_ties) return without_normal_noise(information, pairs, pivot);
  if (pairs.empty()) return information;
  const Matrix7 of_surfaces =
      frame_equations(pairs, {}, photos, pivot, spread, kSigmaFloor).information;
  return information - of_surfaces + without_normal_noise(of_surfaces, pairs, pivot);
}

bool believable(const WeighedTies& weighed, int64_t ties, const RobustOptions& options) {
  const auto used = static_cast<double>(weighed.used);
  return weighed.variance <= kMaxTieVariance && weighed.used >= options.min_ties &&
         used >= kMinTiesAgreeing * static_cast<double>(ties);
}

int64_t number_across(std::span<const TiePoint> ties) {
  return std::count_if(ties.begin(), ties.end(), [](const TiePoint& tie) { return tie.across(); });
}

Eigen::Vector3d mean_of(const std::vector<Eigen::Vector3f>& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3f& x : points) sum += x.cast<double>();
  return sum / static_cast<double>(points.size());
}

}  // namespace

RobustResult align_robust(const OrientedPoints& t1, const OrientedPoints& t2,
                          std::span<const TiePoint> ties, const Sim3& initial_t2_from_t1,
                          const std::optional<InitialUncertainty>& measured,
                          const RobustOptions& options) {
  options.validate();
  RobustResult result;
  result.t2_from_t1 = result.surface_t2_from_t1 = initial_t2_from_t1;
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

  const FrameSpread* spread = options.frame_errors ? &result.uncertainty.frame : nullptr;
  const SurfaceMatcher matcher(t1, t2, options.relative_depth ? 0 : result.extent_u);
  result.ties = number_across(ties);
  if (result.ties < options.min_ties) ties = {};
  const PhotoCounts photos{static_cast<int32_t>(t1.cameras.size()),
                           static_cast<int32_t>(t2.cameras.size())};
  std::vector<SurfacePair> pairs;
  WeighedTies weighed;
  FrameEquations equations;
  Sim3 current = initial_t2_from_t1;
  Vector7 step = Vector7::Zero();
  const int64_t times = (result.points_t1 + result.points_t2) / kSearchingPoints;
  const int stride = static_cast<int>(std::clamp<int64_t>(times, 1, 1000));
  const auto search = [&] {
    matcher.pairs(current, options.both_directions, stride, pairs);
    const Rejected rejected = keep_static(pairs, options);
    result.pairs = static_cast<int64_t>(pairs.size());
    result.rejected_far = rejected.far;
    result.rejected_normal = rejected.normal;
    if (result.pairs < options.min_pairs) pairs.clear();
  };
  const auto weigh = [&] {
    weighed = weigh_ties(ties, current, equations.photos ? &*equations.photos : nullptr, step);
  };
  bool searching = ties.empty();  // ties need no search: until they have converged they go alone
  std::vector<TiePoint> agreeing;
  int steps = 0;  // since the start, or since it started again
  while (!result.converged && steps < options.max_iterations) {
    ++result.iterations;
    ++steps;
    searching = searching || 2 * steps >= options.max_iterations;
    if (searching) search();
    weigh();
    if (searching && !ties.empty() && !believable(weighed, number_across(ties), options)) {
      // Start again, with those that agree pair by pair; if they have been asked already, without.
      if (!result.ties_contradict) agreeing = agreeing_ties(ties, initial_t2_from_t1);
      const bool asked = result.ties_contradict || number_across(agreeing) < options.min_ties;
      result.ties_contradict = true;
      ties = asked ? std::span<const TiePoint>() : agreeing;
      current = initial_t2_from_t1;
      equations = {};
      steps = 1;
      searching = ties.empty();
      pairs.clear();
      if (searching) search();
      weigh();
    }
    if (ties.empty() && pairs.empty()) {
      result.explanation = fmt::format(
          "Kept the initial alignment: {} static surface pairs are fewer than the {} that a "
          "refinement needs.",
          result.pairs, options.min_pairs);
      return result;
    }
    equations =
        frame_equations(pairs, weighed.points, photos, result.pivot_in_t2, spread, kSigmaFloor);

    // The prior's residual is what separates the current from the initial similarity.
    const Vector7 from_initial =
        similarity_parameters(current * initial_t2_from_t1.inverse(), result.pivot_in_t2);
    const Matrix7 information = equations.information + prior_information;
    const Vector7 slope = equations.gradient + prior_information * from_initial;
    step = -information.ldlt().solve(slope);
    current = small_similarity(step, result.pivot_in_t2) * current;
    const bool small = step.dot(information * step) < kConvergedStep * kConvergedStep;
    result.converged = small && searching;
    searching = searching || small;
  }
  result.relative_sigma = equations.relative_sigma;
  result.ties_used = weighed.used;
  result.tie_deviation = std::sqrt(weighed.variance);
  result.residual_sigma_u = result.relative_sigma * median_over(pairs, [](const SurfacePair& pair) {
                              return pair.depth_u;
                            });
  const Constraints constraints =
      constraints_of(held_information(equations.information, pairs, !ties.empty(), photos,
                                      result.pivot_in_t2, spread),
                     prior_covariance, result.pivot_in_t2, t2.origin_in_world);
  result.covariance = result.surface_covariance = constraints.covariance;
  result.constrained_share = constraints.constrained_share;
  result.open_degrees_of_freedom = constraints.open_degrees_of_freedom;
  result.open_motions = constraints.open_motions;

  result.compared_by = ties.empty() ? CandidateCost::kSurfaces : CandidateCost::kTiePoints;
  result.tie_variance = weigh_ties(ties, current, nullptr, step).variance;
  const auto cost_at = [&](const Sim3& t2_from_t1) {
    return ties.empty() ? surface_cost(matcher, t2_from_t1, result.relative_sigma, options)
                        : tie_cost(ties, t2_from_t1, result.tie_variance);
  };
  result.cost_initial = cost_at(initial_t2_from_t1);
  result.cost_final = cost_at(current);
  if (result.cost_final >= result.cost_initial) {
    result.verdict = RobustVerdict::kKeptInitialNotBetter;
    result.explanation = fmt::format(
        "Kept the initial alignment: the refined one does not fit the {} better (cost {:.4g} "
        "before, {:.4g} after).",
        ties.empty() ? "static surfaces" : "tie points", result.cost_initial, result.cost_final);
    return result;
  }
  result.verdict = result.converged ? RobustVerdict::kRefined : RobustVerdict::kNotConverged;
  result.t2_from_t1 = result.surface_t2_from_t1 = current;
  if (spread) {
    search();
    weigh();
    const PhotoErrors errors =
        photo_errors(pairs, weighed.points, photos, result.pivot_in_t2, *spread, kSigmaFloor);
    std::vector<Eigen::Vector3d> cameras_t1 = t1.cameras;
    for (Eigen::Vector3d& camera : cameras_t1) camera = current * camera;
    const CameraFit fit =
        fit_cameras(errors, cameras_t1, t2.cameras, result.pivot_in_t2, result.covariance, *spread);
    result.surface_covariance += fit.bend;
    if (options.camera_fit) {
      result.t2_from_t1 = small_similarity(fit.step, result.pivot_in_t2) * current;
      result.covariance = fit.covariance;
    }
    result.covariance += fit.bend;
  }
  const std::string ties_used =
      ties.empty() ? "" : fmt::format("{} tie points between photos and ", result.ties_used);
  result.explanation = fmt::format(
      "Refined rotation, translation and scale on {}{} static surface pairs, which fit to {:.3g}.",
      ties_used, pairs.size(), result.residual_sigma_u);
  if (!result.converged) {
    result.explanation +=
        fmt::format(" It did not come to rest in {} steps, so it may be off by more than it says.",
                    result.iterations);
  }
  if (!result.open_motions.empty()) {
    result.explanation += fmt::format(
        " Held by the initial alignment only, not by what is static: {} (in the T2 frame).",
        fmt::join(result.open_motions, "; "));
  }
  return result;
}

std::vector<std::string> RobustResult::doubts() const {
  std::vector<std::string> doubts;
  if (verdict == RobustVerdict::kNotConverged) {
    doubts.emplace_back("the refinement did not come to rest");
  }
  if (ties_contradict) {
    doubts.push_back(fmt::format(
        "places that photos of both epochs show alike contradict each other, and {} of {} are used",
        ties_used, ties));
  }
  return doubts;
}

double candidate_cost(const OrientedPoints& t1, const OrientedPoints& t2,
                      std::span<const TiePoint> ties, const Sim3& t2_from_t1,
                      const RobustResult& scale, const RobustOptions& options) {
  if (scale.compared_by == CandidateCost::kTiePoints) {
    return tie_cost(ties, t2_from_t1, scale.tie_variance);
  }
  const SurfaceMatcher matcher(t1, t2, options.relative_depth ? 0 : scale.extent_u);
  return surface_cost(matcher, t2_from_t1, scale.relative_sigma, options);
}

}  // namespace vggtcd
