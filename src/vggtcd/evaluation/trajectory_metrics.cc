// SPDX-License-Identifier: Apache-2.0
// ATE, RTE, RRE.
#include "vggtcd/evaluation/trajectory_metrics.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "vggtcd/core/error.h"
#include "vggtcd/geometry/umeyama.h"

namespace vggtcd {
namespace {

void append_centers(std::span<const Rigid3> poses, std::vector<Eigen::Vector3d>& centers) {
  for (const Rigid3& camera_from_world : poses) centers.push_back(camera_center(camera_from_world));
}

struct RelativeErrors {
  double translation = 0, rotation_rad = 0, length = 0;
  int pairs = 0;

  void add(std::span<const Rigid3> predicted, std::span<const Rigid3> truth, double scale) {
    for (size_t k = 0; k + 1 < predicted.size(); ++k) {
      const Rigid3 step = predicted[k] * predicted[k + 1].inverse();
      const Rigid3 true_step = truth[k] * truth[k + 1].inverse();
      translation += (scale * step.translation - true_step.translation).norm();
      rotation_rad += rotation_angle_rad(step.rotation.transpose() * true_step.rotation);
      length += true_step.translation.norm();
      ++pairs;
    }
  }
};

}  // namespace

BitemporalTrajectory register_trajectory(std::span<const Rigid3> t1, std::span<const Rigid3> t2,
                                         const Sim3& t2_from_t1) {
  BitemporalTrajectory result;
  for (const Rigid3& pose : t1) result.t1.push_back(camera_from_new_world(pose, t2_from_t1));
  result.t2.assign(t2.begin(), t2.end());
  return result;
}

TrajectoryErrors evaluate_trajectory(const BitemporalTrajectory& predicted,
                                     const BitemporalTrajectory& truth) {
  if (predicted.t1.size() != truth.t1.size() || predicted.t2.size() != truth.t2.size()) {
    throw_error(ErrorCode::kInput,
                "trajectories: expected {} + {} poses as in the truth, found {} + {}",
                truth.t1.size(), truth.t2.size(), predicted.t1.size(), predicted.t2.size());
  }
  std::vector<Eigen::Vector3d> centers, true_centers;
  append_centers(predicted.t1, centers);
  append_centers(predicted.t2, centers);
  append_centers(truth.t1, true_centers);
  append_centers(truth.t2, true_centers);
  const UmeyamaResult fit = umeyama(centers, true_centers);
  if (!fit.determined()) {
    throw_error(ErrorCode::kDegenerate, "trajectories: the camera centres fix no similarity ({})",
                describe(fit.status));
  }
  TrajectoryErrors errors;
  errors.truth_from_predicted = fit.y_from_x;
  errors.frames = static_cast<int>(centers.size());
  std::vector<double> distances;
  for (size_t k = 0; k < centers.size(); ++k) {
    distances.push_back((fit.y_from_x * centers[k] - true_centers[k]).norm());
  }
  double sum = 0, squares = 0;
  for (const double d : distances) {
    sum += d;
    squares += d * d;
  }
  const double count = static_cast<double>(distances.size());
  errors.ate_mean = sum / count;
  errors.ate_rmse = std::sqrt(squares / count);
  std::sort(distances.begin(), distances.end());
  const size_t half = distances.size() / 2;
  errors.ate_median =
      distances.size() % 2 ? distances[half] : 0.5 * (distances[half - 1] + distances[half]);

  RelativeErrors relative;
  relative.add(predicted.t1, truth.t1, fit.y_from_x.scale);
  relative.add(predicted.t2, truth.t2, fit.y_from_x.scale);
  errors.trajectory_length = relative.length;
  errors.ate_relative = relative.length > 0 ? errors.ate_mean / relative.length : 0;
  if (relative.pairs > 0) {
    errors.rte_mean = relative.translation / relative.pairs;
    errors.rre_mean_deg = relative.rotation_rad / relative.pairs * 180 / std::numbers::pi;
  }
  return errors;
}

}  // namespace vggtcd
