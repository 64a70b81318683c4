// SPDX-License-Identifier: Apache-2.0
// From aligned surfaces to aligned cameras, by least squares over the photos' own similarities.
#include "vggtcd/registration/camera_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

namespace vggtcd {
namespace {

constexpr double kSurfaceWeight = 0.03;  // of what a photo shows against its camera
// A pass is bent in waves longer than what it shows, so its photos err alike in stretches of about
// half a walk.
constexpr double kStretches = 2;
constexpr double kMinScattered = 4;  // cameras
constexpr double kBallShare = 0.5;   // radius of the ball around it, of the viewing distance

// J^T J of the displacement of x by a small similarity about the pivot.
Matrix7 information_at(const Eigen::Vector3d& x, const Eigen::Vector3d& pivot) {
  const Matrix3x7 jacobian = point_jacobian(x - pivot);
  return jacobian.transpose() * jacobian;
}

// How much a photo's similarity counts, about the pivot.
Matrix7 photo_weight(const Eigen::Vector3d& camera, const Eigen::Vector3d& shown,
                     const Eigen::Vector3d& pivot) {
  const double radius = kBallShare * (shown - camera).norm();
  Matrix7 ball = Matrix7::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-radius, radius}) {
      ball += information_at(shown + side * Eigen::Vector3d::Unit(axis), pivot) / 6;
    }
  }
  return information_at(camera, pivot) + kSurfaceWeight * ball;
}

}  // namespace

CameraFit fit_cameras(const PhotoErrors& photos, std::span<const Eigen::Vector3d> cameras_t1,
                      std::span<const Eigen::Vector3d> cameras_t2, const Eigen::Vector3d& pivot,
                      const Matrix7& theta_covariance, const FrameSpread& frame_spread) {
  // The answer is theta + fit * b: both epochs' weighted means of their photos' similarities.
  Eigen::MatrixXd fit = Eigen::MatrixXd::Zero(7, photos.mean.size());
  Matrix7 bend = Matrix7::Zero();
  const auto add_epoch = [&](std::span<const Eigen::Vector3d> cameras, bool is_t1) {
    Matrix7 total = Matrix7::Zero();
    Eigen::MatrixXd sum = Eigen::MatrixXd::Zero(7, photos.mean.size());
    std::vector<std::pair<Eigen::Vector3d, size_t>> known;  // cameras and their groups
    for (size_t frame = 0; frame < cameras.size(); ++frame) {
      const size_t group = photos.groups.of({is_t1, static_cast<int32_t>(frame)});
      if (photos.known[group]) known.emplace_back(cameras[frame], group);
    }
    if (known.empty()) return;
    for (const auto& [camera, group] : known) {
      const Eigen::Vector3d& center = photos.centers[group];
      const Matrix7 weight = photo_weight(camera, center, pivot);
      total += weight;
      sum.block<7, 7>(0, 7 * static_cast<Eigen::Index>(group)) +=
          weight * pivot_change(pivot - center);
    }
    const Matrix7 inverse = total.ldlt().solve(Matrix7::Identity());
    const Eigen::MatrixXd of_epoch = inverse * sum;
    fit += (is_t1 ? 1.0 : -1.0) * of_epoch;

    const Vector7 common = of_epoch * photos.mean;
    double scatter = 0;  // of the cameras about the fit, squared
    for (const auto& [camera, group] : known) {
      const Vector7 own = photos.mean.segment<7>(7 * static_cast<Eigen::Index>(group));
      scatter += (point_jacobian(camera - photos.centers[group]) * own -
                  point_jacobian(camera - pivot) * common)
                     .squaredNorm();
    }
    const auto count = static_cast<double>(known.size());
    // Fewer show no scatter whatever they err.
    if (count < kMinScattered) {
      scatter = 3 * count * frame_spread.translation_u * frame_spread.translation_u;
    }
    bend += scatter / (3 * std::min(count, kStretches)) * inverse;
  };
  add_epoch(cameras_t1, true);
  add_epoch(cameras_t2, false);

  CameraFit result;
  result.step = fit * photos.mean;
  const Matrix7 response = Matrix7::Identity() + fit * photos.response;
  result.covariance = response * theta_covariance * response.transpose() +
                      fit * photos.covariance * fit.transpose();
  result.bend = bend;
  return result;
}

}  // namespace vggtcd
