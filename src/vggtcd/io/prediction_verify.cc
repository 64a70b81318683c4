// SPDX-License-Identifier: Apache-2.0
// The same key means opposite poses in different programs. World points tell which.
#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "vggtcd/core/error.h"
#include "vggtcd/geometry/order_statistics.h"
#include "vggtcd/io/prediction_layout.h"

namespace vggtcd::internal {
namespace {

constexpr size_t kSamples = 10000;
constexpr size_t kFewestSamples = 16;

// Median distance to the file's points in units of depth. VGGT's two heads agree within a few
// percent; exact points within the rounding of half precision. Poses read the wrong way round are
// off by about the distance that the cameras travelled.
constexpr double kAgrees = 0.05;
constexpr double kExplains = 0.25;  // the other way must fit at least this well ...
constexpr double kBetter = 0.5;     // ... and be better than ours by this factor

struct Sample {
  size_t pixel = 0;
  Eigen::Vector3d x_in_file = Eigen::Vector3d::Zero();
};

// Evenly spaced pixels with depth. A step without a factor in common with the width walks through
// all columns.
std::vector<Sample> choose_samples(const Reconstruction& reconstruction) {
  const size_t pixels = reconstruction.num_pixels();
  size_t step = std::max<size_t>(1, pixels / kSamples);
  while (std::gcd(step, static_cast<size_t>(reconstruction.width)) != 1) ++step;
  std::vector<Sample> samples;
  for (size_t pixel = 0; pixel < pixels; pixel += step) {
    if (reconstruction.depth[pixel] > 0) samples.push_back({pixel});
  }
  return samples;
}

void read_points(const NpzReader& npz, const std::string& key, std::vector<Sample>& samples) {
  size_t next = 0;  // coordinate 3 * sample + axis that comes next in the file
  npz.read_slabs<double>(key, [&](int64_t first, std::span<const double> values) {
    const size_t begin = static_cast<size_t>(first);
    for (; next < 3 * samples.size(); ++next) {
      Sample& sample = samples[next / 3];
      const size_t index = 3 * sample.pixel + next % 3;
      if (index >= begin + values.size()) break;
      sample.x_in_file[static_cast<Eigen::Index>(next % 3)] = values[index - begin];
    }
  });
}

// rounding: of coordinates in the file, relative; what it explains is no disagreement.
double median_relative_error(const Reconstruction& reconstruction,
                             const std::vector<Sample>& samples, bool inverted, double rounding) {
  const size_t width = static_cast<size_t>(reconstruction.width);
  std::vector<double> errors;
  for (const Sample& sample : samples) {
    const View& view = reconstruction.views[sample.pixel / reconstruction.pixels_per_frame()];
    const size_t in_frame = sample.pixel % reconstruction.pixels_per_frame();
    const double depth = reconstruction.depth[sample.pixel];
    const Rigid3 world_from_camera =
        inverted ? view.camera_from_world : view.camera_from_world.inverse();
    const Eigen::Vector3d x_in_world =
        world_from_camera * view.pinhole.unproject(static_cast<double>(in_frame % width),
                                                   static_cast<double>(in_frame / width), depth);
    const double rounded_by = rounding * sample.x_in_file.norm();
    errors.push_back(std::max(0.0, (x_in_world - sample.x_in_file).norm() - rounded_by) / depth);
  }
  return middle_of(std::move(errors));
}

}  // namespace

void verify_poses(const NpzReader& npz, const PredictionLayout& layout,
                  const Reconstruction& reconstruction, ProgressSink& progress) {
  if (layout.world_points.empty()) return;
  const std::string& key = layout.world_points;
  npz.expect_shape(key, std::vector<int64_t>{layout.frames, layout.height, layout.width, 3});
  std::vector<Sample> samples = choose_samples(reconstruction);
  read_points(npz, key, samples);
  std::erase_if(samples, [](const Sample& sample) { return !sample.x_in_file.allFinite(); });
  if (samples.size() < kFewestSamples) return;

  // Far from the origin the digits of 32-bit numbers end above any error that matters.
  const bool doubles = npz.header(key).item_size >= 8 && npz.header(layout.poses).item_size >= 8;
  const double rounding = doubles ? 0 : 2e-7;  // of position and direction: a step of a float each
  const double error = median_relative_error(reconstruction, samples, false, rounding);
  const double inverted = median_relative_error(reconstruction, samples, true, rounding);
  if (error <= kAgrees) return;
  const auto way = [&](bool other) {
    return layout.world_from_camera != other ? "world-from-camera" : "camera-from-world";
  };
  if (inverted <= kExplains && inverted < kBetter * error) {
    throw_error(ErrorCode::kInput,
                "{}: {}: expected {} poses, but {} agrees with {} (median error {:.3g} of the "
                "depth, against {:.3g}); invert the poses, or remove {} if it is wrong",
                npz.name(), layout.poses, way(false), key, way(true), inverted, error, key);
  }
  const std::string disagreement = fmt::format(
      "{} does not agree with depth and {} (median error {:.3g} of the depth as {}, "
      "{:.3g} as {})",
      key, layout.poses, error, way(false), inverted, way(true));
  if (layout.points_are_exact) {
    throw_error(ErrorCode::kInput, "{}: expected points computed from depth, but {}", npz.name(),
                disagreement);
  }
  progress.notice(fmt::format("{}: {}; the poses could not be verified", npz.name(), disagreement));
}

}  // namespace vggtcd::internal
