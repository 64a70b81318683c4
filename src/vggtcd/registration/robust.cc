// SPDX-License-Identifier: Apache-2.0
// Robust registration: all seven parameters from the static surfaces of both epochs, held near the
// initial similarity by its own uncertainty.
#include "vggtcd/registration/robust.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>

#include "vggtcd/geometry/order_statistics.h"
#include "vggtcd/geometry/robust_extent.h"
#include "vggtcd/registration/surface_pairs.h"

namespace vggtcd {
namespace {

constexpr double kSigmaFromMad = 1.4826;  // of a normal distribution
constexpr double kTukeyTuning = 4.685;    // 95 % efficiency under a normal distribution
constexpr double kConvergedStep = 1e-6;   // rad, log scale, share of the extent
constexpr double kWeakShare = 0.5;
// Residuals are never believed to be smaller than this share of the extent: on data without noise
// the rounding of float positions would otherwise count as information.
constexpr double kSigmaFloor = 1e-4;

double tukey_weight(double residual, double sigma) {
  const double x = residual / (kTukeyTuning * sigma);
  return x * x < 1 ? (1 - x * x) * (1 - x * x) : 0;
}

// Tukey's loss scaled to end at 1.
double tukey_loss(double residual, double sigma) {
  const double x = residual / (kTukeyTuning * sigma);
  const double rest = 1 - x * x;
  return x * x < 1 ? 1 - rest * rest * rest : 1;
}

double median_of(const std::vector<SurfacePair>& pairs, double (*value)(const SurfacePair&)) {
  std::vector<float> values;
  values.reserve(pairs.size());
  for (const SurfacePair& pair : pairs) values.push_back(static_cast<float>(value(pair)));
  return values.empty() ? 0 : static_cast<double>(median(values));
}

struct StaticPairs {
  std::vector<SurfacePair> pairs;
  int64_t rejected_far = 0;
  int64_t rejected_normal = 0;
};

// The gates: near in medians of the distance, and surfaces that face the same way.
StaticPairs static_pairs(const std::vector<SurfacePair>& all, const RobustOptions& options) {
  const double limit = options.static_distance *
                       median_of(all, [](const SurfacePair& pair) { return pair.distance; });
  StaticPairs result;
  for (const SurfacePair& pair : all) {
    if (pair.distance > limit) {
      ++result.rejected_far;
    } else if (pair.normal_cosine < options.min_normal_cosine) {
      ++result.rejected_normal;
    } else {
      result.pairs.push_back(pair);
    }
  }
  return result;
}

// The normal equations of one linearisation, in information units (divided by sigma^2), and the
// scatter of the clusters' gradients.
struct NormalEquations {
  Matrix7 hessian = Matrix7::Zero();
  Vector7 gradient = Vector7::Zero();
  Matrix7 cluster_scatter = Matrix7::Zero();
  double sigma = 0;

  // How many pairs of one cluster say what one would: trace(H^-1 S) / 7 against independent
  // residuals.
  double design_effect() const {
    // Directions without information have no scatter either; the ridge keeps the solve defined.
    const Matrix7 ridge = 1e-9 * hessian.diagonal().maxCoeff() * Matrix7::Identity();
    return std::max(1.0, (hessian + ridge).ldlt().solve(cluster_scatter).trace() / 7.0);
  }
};

NormalEquations linearise(const std::vector<SurfacePair>& pairs, const Eigen::Vector3d& pivot,
                          double min_sigma, int32_t num_clusters) {
  NormalEquations result;
  const double mad =
      median_of(pairs, [](const SurfacePair& pair) { return std::abs(pair.plane_residual()); });
  result.sigma = std::max(min_sigma, kSigmaFromMad * mad);
  const double information = 1 / (result.sigma * result.sigma);
  std::vector<Vector7> cluster_gradient(static_cast<size_t>(num_clusters), Vector7::Zero());
  for (const SurfacePair& pair : pairs) {
    const double residual = pair.plane_residual();
    const double weight = information * tukey_weight(residual, result.sigma);
    if (weight == 0) continue;
    const Eigen::Vector3d arm = pair.moving - pivot;
    Vector7 jacobian;
    jacobian << arm.cross(pair.normal), pair.normal, pair.normal.dot(arm);
    result.hessian += weight * jacobian * jacobian.transpose();
    cluster_gradient[static_cast<size_t>(pair.cluster)] += weight * residual * jacobian;
  }
  for (const Vector7& gradient : cluster_gradient) {
    result.gradient += gradient;
    result.cluster_scatter += gradient * gradient.transpose();
  }
  return result;
}

std::string describe_direction(const Vector7& direction) {
  // The parameters are in units of their prior, so that their sizes compare.
  const double rotation = direction.segment<3>(0).norm();
  const double translation = direction.segment<3>(3).norm();
  const double scale = std::abs(direction[6]);
  const auto axis = [](Eigen::Vector3d v) {
    v.normalize();
    Eigen::Index largest = 0;
    v.cwiseAbs().maxCoeff(&largest);
    if (v[largest] < 0) v = -v;
    return fmt::format("({:.2f}, {:.2f}, {:.2f})", v.x(), v.y(), v.z());
  };
  std::vector<std::string> parts;
  constexpr double kNoticeable = 0.4;
  if (rotation > kNoticeable) parts.push_back("rotation about " + axis(direction.segment<3>(0)));
  if (translation > kNoticeable)
    parts.push_back("translation along " + axis(direction.segment<3>(3)));
  if (scale > kNoticeable) parts.push_back("scale");
  return fmt::format("{}", fmt::join(parts, " with "));
}

// Uncertainty and constraint of the solution from its information matrix and the prior's.
void report_uncertainty(const Matrix7& data_information, const Vector7& prior_sigma,
                        RobustResult& result) {
  const Matrix7 prior_information = prior_sigma.cwiseInverse().cwiseAbs2().asDiagonal();
  result.covariance = (data_information + prior_information).inverse();
  const Matrix7 to_prior_units = prior_sigma.cwiseInverse().asDiagonal();
  const Matrix7 relative =
      to_prior_units * result.covariance * to_prior_units;  // identity: prior alone
  result.constrained_share = (Vector7::Ones() - relative.diagonal()).cwiseMax(0.0).cwiseMin(1.0);
  const Eigen::SelfAdjointEigenSolver<Matrix7> eigen(relative);
  for (int i = 6; i >= 0; --i) {
    if (1 - eigen.eigenvalues()[i] < kWeakShare) {
      result.weak_directions.push_back(describe_direction(eigen.eigenvectors().col(i)));
    }
  }
}

double cost_of(const std::vector<SurfacePair>& all, double sigma_u, double min_normal_cosine) {
  if (all.empty()) return 1;
  double sum = 0;
  // The nearest point may lie beside the surface rather than on it, by up to the voxel size; what
  // matters is the distance to its plane, and that it is not far away altogether.
  for (const SurfacePair& pair : all) {
    const bool compatible = pair.normal_cosine >= min_normal_cosine;
    const double along = 0.25 * pair.distance;
    const double residual = std::max(std::abs(pair.plane_residual()), along);
    sum += compatible ? tukey_loss(residual, sigma_u) : 1;
  }
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
  check_field(max_iterations >= 1, "max_iterations", max_iterations, "at least 1");
  check_field(min_pairs >= 7, "min_pairs", min_pairs, "at least 7");
}

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

RobustResult align_robust(const OrientedPoints& t1, const OrientedPoints& t2,
                          const Sim3& initial_t2_from_t1, const RobustOptions& options) {
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
  for (const Eigen::Vector3f& x : t2.positions) result.pivot_in_t2 += x.cast<double>();
  result.pivot_in_t2 /= static_cast<double>(t2.size());
  result.extent_u = robust_extent(t2.positions);
  Vector7 prior_sigma = Vector7::Constant(options.prior_sigma);
  prior_sigma.segment<3>(3) *= result.extent_u;
  const Vector7 prior_information = prior_sigma.cwiseInverse().cwiseAbs2();

  const SurfaceMatcher matcher(t1, t2);
  Sim3 current = initial_t2_from_t1;
  Matrix7 data_information = Matrix7::Zero();
  for (result.iterations = 1; result.iterations <= options.max_iterations; ++result.iterations) {
    const StaticPairs gated = static_pairs(matcher.pairs(current), options);
    result.pairs = static_cast<int64_t>(gated.pairs.size());
    result.rejected_far = gated.rejected_far;
    result.rejected_normal = gated.rejected_normal;
    if (result.pairs < options.min_pairs) {
      result.explanation = fmt::format(
          "Kept the initial alignment: {} static surface pairs are fewer than the {} that a "
          "refinement needs.",
          result.pairs, options.min_pairs);
      return result;
    }
    const NormalEquations equations = linearise(
        gated.pairs, result.pivot_in_t2, kSigmaFloor * result.extent_u, matcher.num_clusters());
    const double design_effect = equations.design_effect();
    result.residual_sigma_u = equations.sigma;
    result.effective_pairs = static_cast<double>(result.pairs) / design_effect;
    data_information = equations.hessian / design_effect;

    // Minimise data + prior: the prior's residual is what separates the current from the initial
    // similarity.
    const Vector7 from_initial =
        similarity_parameters(current * initial_t2_from_t1.inverse(), result.pivot_in_t2);
    const Matrix7 information = data_information + Matrix7(prior_information.asDiagonal());
    const Vector7 slope =
        equations.gradient / design_effect + prior_information.cwiseProduct(from_initial);
    const Vector7 step = -information.ldlt().solve(slope);
    current = small_similarity(step, result.pivot_in_t2) * current;
    Vector7 relative_step = step;
    relative_step.segment<3>(3) /= result.extent_u;
    if (relative_step.norm() < kConvergedStep) break;
  }
  result.iterations = std::min(result.iterations, options.max_iterations);
  report_uncertainty(data_information, prior_sigma, result);

  result.cost_initial = cost_of(matcher.pairs(initial_t2_from_t1), result.residual_sigma_u,
                                options.min_normal_cosine);
  result.cost_final =
      cost_of(matcher.pairs(current), result.residual_sigma_u, options.min_normal_cosine);
  if (result.cost_final >= result.cost_initial) {
    result.verdict = RobustVerdict::kKeptInitialNotBetter;
    result.explanation = fmt::format(
        "Kept the initial alignment: the refined one does not fit the static surfaces better (cost "
        "{:.4g} "
        "before, {:.4g} after).",
        result.cost_initial, result.cost_final);
    return result;
  }
  result.verdict = RobustVerdict::kRefined;
  result.t2_from_t1 = current;
  result.explanation = fmt::format(
      "Refined rotation, translation and scale on {} static surface pairs; they fit to {:.3g}.",
      result.pairs, result.residual_sigma_u);
  if (!result.weak_directions.empty()) {
    result.explanation +=
        fmt::format(" Not fixed by the static surfaces and kept near the initial alignment: {}.",
                    fmt::join(result.weak_directions, "; "));
  }
  return result;
}

double surface_cost(const OrientedPoints& t1, const OrientedPoints& t2, const Sim3& t2_from_t1,
                    double sigma_u, double min_normal_cosine) {
  check(sigma_u > 0, "surface_cost: positive sigma");
  return cost_of(SurfaceMatcher(t1, t2).pairs(t2_from_t1), sigma_u, min_normal_cosine);
}

}  // namespace vggtcd
