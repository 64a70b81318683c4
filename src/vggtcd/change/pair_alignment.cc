// SPDX-License-Identifier: Apache-2.0
// One photo of an epoch against one of the other, aligned once more.
#include "vggtcd/change/pair_alignment.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "vggtcd/geometry/order_statistics.h"

namespace vggtcd {
namespace {

using Vector7 = Eigen::Matrix<double, 7, 1>;
using Matrix7 = Eigen::Matrix<double, 7, 7>;

constexpr int kMinSamples = 50;
constexpr double kSmooth = 1.05;  // far / near of a window that shows one surface
constexpr double kSigmaFromMad = 1.4826;
constexpr double kMinSigma = 1e-3;  // relative; below it the prior holds what a plane leaves free
constexpr double kMinGate = 0.01;   // relative; the gate never closes further

struct Sample {
  size_t point = 0;                    // index
  double gap = 0;                      // depth / z - 1
  Vector7 jacobian = Vector7::Zero();  // of gap by (w, t, s)
};

// The mean depth of the window and its slopes per pixel; false off the photo, at an edge, or where
// nothing testifies.
bool smooth_depth(const WitnessPhoto& photo, double u, double v, double& depth,
                  Eigen::Vector2d& slope) {
  const int x = static_cast<int>(std::floor(u + 0.5)), y = static_cast<int>(std::floor(v + 0.5));
  const int width = photo.pinhole.width, height = photo.pinhole.height;
  if (x < 1 || y < 1 || x >= width - 1 || y >= height - 1) return false;
  const auto mean = [&](int column, int row, double& value) {
    float near = 0, far = 0;
    if (!photo.windows.read(column, row, near, far)) return false;
    value = 0.5 * (static_cast<double>(near) + static_cast<double>(far));
    return static_cast<double>(far) < kSmooth * static_cast<double>(near);
  };
  double left = 0, right = 0, above = 0, below = 0;
  if (!mean(x, y, depth) || !mean(x - 1, y, left) || !mean(x + 1, y, right) ||
      !mean(x, y - 1, above) || !mean(x, y + 1, below)) {
    return false;
  }
  slope = {0.5 * (right - left), 0.5 * (below - above)};
  depth += slope.x() * (u - x) + slope.y() * (v - y);
  return true;
}

std::vector<Sample> samples_of(std::span<const Eigen::Vector3f> points, const WitnessPhoto& photo,
                               const PairAlignment& pair) {
  std::vector<Sample> samples;
  const Pinhole& k = photo.pinhole;
  for (size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d p = pair.matrix * points[i].cast<double>() + pair.offset;
    if (!(p.z() > 0)) continue;
    const Eigen::Vector2d uv = k.project(p);
    double depth = 0;
    Eigen::Vector2d slope;
    if (!k.contains(uv.x(), uv.y()) || !smooth_depth(photo, uv.x(), uv.y(), depth, slope)) continue;
    Sample sample;
    sample.point = i;
    sample.gap = depth / p.z() - 1;
    // d(depth - z) by p: the pixel moves along the slope, and z itself moves.
    const Eigen::Vector3d by_p(
        slope.x() * k.fx / p.z(), slope.y() * k.fy / p.z(),
        -(slope.x() * k.fx * p.x() + slope.y() * k.fy * p.y()) / (p.z() * p.z()) - 1);
    sample.jacobian << p.cross(by_p), by_p, p.dot(by_p);
    sample.jacobian /= p.z();
    samples.push_back(sample);
  }
  return samples;
}

// The robust sigma of the gaps within the gate around their median (with its middle elements alone,
// so no order matters); the number of them.
double sigma_within(const std::vector<Sample>& samples, double gate, int& count) {
  std::vector<double> gaps;
  for (const Sample& sample : samples) {
    if (std::abs(sample.gap) < gate) gaps.push_back(std::abs(sample.gap));
  }
  count = static_cast<int>(gaps.size());
  if (gaps.empty()) return 0;
  return kSigmaFromMad * middle_of(std::move(gaps));
}

}  // namespace

PairAlignment align_pair(std::span<const Eigen::Vector3f> points, const WitnessPhoto& photo,
                         double gate, double scene_extent_u, const PairAlignmentOptions& options) {
  PairAlignment pair{photo.camera_from_t2.rotation, photo.camera_from_t2.translation, gate / 4, 0};
  const double translation = options.prior_translation * scene_extent_u;
  const double rotation = options.prior_rotation_rad;
  Vector7 prior;
  prior << rotation, rotation, rotation, translation, translation, translation,
      options.prior_log_scale;
  const Vector7 information = prior.cwiseAbs2().cwiseInverse();
  Vector7 total = Vector7::Zero();  // what was corrected so far, to first order
  const PairAlignment uncorrected = pair;
  for (int iteration = 0; iteration <= options.iterations; ++iteration) {
    const std::vector<Sample> samples = samples_of(points, photo, pair);
    const double sigma = sigma_within(samples, gate, pair.samples);
    if (pair.samples < kMinSamples) return uncorrected;
    pair.gap_sigma = sigma;
    if (iteration == options.iterations) break;
    gate = std::clamp(4 * sigma, kMinGate, gate);
    // Neighbouring samples err alike: a few hundred count as a few dozen.
    const double weight = 1.0 / (10 * std::max(sigma * sigma, kMinSigma * kMinSigma));
    Matrix7 normal = information.asDiagonal();
    Vector7 right = -information.cwiseProduct(total);
    for (const Sample& sample : samples) {
      const double ratio = sample.gap / gate;
      if (std::abs(ratio) >= 1) continue;
      const double tukey = weight * (1 - ratio * ratio) * (1 - ratio * ratio);
      normal += tukey * sample.jacobian * sample.jacobian.transpose();
      right -= tukey * sample.gap * sample.jacobian;
    }
    const Vector7 step = normal.ldlt().solve(right);
    if (!step.allFinite()) return uncorrected;
    total += step;
    Eigen::Matrix3d small = (1 + step[6]) * Eigen::Matrix3d::Identity();
    small += (Eigen::Matrix3d() << 0, -step[2], step[1], step[2], 0, -step[0], -step[1], step[0], 0)
                 .finished();
    pair.matrix = small * pair.matrix;
    pair.offset = small * pair.offset + step.segment<3>(3);
  }
  return pair;
}

std::vector<SurfaceGap> surface_gaps(std::span<const Eigen::Vector3f> points,
                                     const Eigen::Vector3d& center, const WitnessPhoto& photo,
                                     const PairAlignment& pair) {
  std::vector<SurfaceGap> gaps;
  for (const Sample& sample : samples_of(points, photo, pair)) {
    const Eigen::Vector3d by_log_distance =
        pair.matrix * (points[sample.point].cast<double>() - center);
    gaps.push_back({sample.point, sample.gap, sample.jacobian.segment<3>(3).dot(by_log_distance)});
  }
  return gaps;
}

}  // namespace vggtcd
