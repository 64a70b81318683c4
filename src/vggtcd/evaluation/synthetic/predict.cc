// SPDX-License-Identifier: Apache-2.0
// The error model, term by term.
#include "vggtcd/evaluation/synthetic/predict.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/evaluation/synthetic/random.h"
#include "vggtcd/scene/keyframes.h"

namespace vggtcd {
namespace {

using Eigen::Vector3d;

// Streams of random numbers; one per cause, so that switching one off leaves the others alone.
enum Stream : uint64_t { kWarp = 1, kDepth, kPixel, kDrift, kFocal, kOutlier, kConfidence, kScale };

// A smooth random vector field: a few waves of random direction, length and push. Each component
// has unit variance.
class SmoothField {
 public:
  SmoothField(double shortest_m, double longest_m, Random random) {
    for (Wave& wave : waves_) {
      const Vector3d direction{random.normal(), random.normal(), random.normal()};
      const double wavelength = random.uniform(shortest_m, longest_m);
      wave.frequency = 2 * std::numbers::pi / wavelength * direction.normalized();
      wave.phase = random.uniform(0, 2 * std::numbers::pi);
      const Vector3d push{random.normal(), random.normal(), random.normal()};
      wave.push = push * std::sqrt(2.0 / kWaves);
    }
  }
  Vector3d value(const Vector3d& x) const {
    Vector3d sum = Vector3d::Zero();
    for (const Wave& wave : waves_) sum += wave.push * std::sin(wave.frequency.dot(x) + wave.phase);
    return sum;
  }
  // Half the curl: how a displacement by the field turns a small body.
  Vector3d turn(const Vector3d& x) const {
    Vector3d sum = Vector3d::Zero();
    for (const Wave& wave : waves_) {
      sum += 0.5 * wave.frequency.cross(wave.push) * std::cos(wave.frequency.dot(x) + wave.phase);
    }
    return sum;
  }

 private:
  static constexpr int kWaves = 6;
  struct Wave {
    Vector3d frequency, push;
    double phase = 0;
  };
  Wave waves_[kWaves];
};

Eigen::Matrix3d small_rotation(const Vector3d& rotation_rad) {
  const double angle = rotation_rad.norm();
  if (angle < 1e-12) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, rotation_rad / angle).toRotationMatrix();
}

// A smooth field over the photo: random values on a 6 x 5 grid, smoothly interpolated. Unit
// variance at the nodes.
class LowFrequency {
 public:
  explicit LowFrequency(Random random) {
    for (double& node : nodes_) node = random.normal();
  }
  double at(double u_share, double v_share) const {
    const double x = u_share * (kColumns - 1), y = v_share * (kRows - 1);
    const int column = std::clamp(static_cast<int>(x), 0, kColumns - 2);
    const int row = std::clamp(static_cast<int>(y), 0, kRows - 2);
    const auto ease = [](double t) { return t * t * (3 - 2 * t); };
    const double s = ease(x - column), t = ease(y - row);
    const auto node = [&](int r, int c) { return nodes_[r * kColumns + c]; };
    const double top = node(row, column) + s * (node(row, column + 1) - node(row, column));
    const double bottom =
        node(row + 1, column) + s * (node(row + 1, column + 1) - node(row + 1, column));
    return top + t * (bottom - top);
  }

 private:
  static constexpr int kColumns = 6, kRows = 5;
  double nodes_[kColumns * kRows];
};

struct FrameErrors {
  double size = 1;         // of all errors: the pass's, and an outlier's own
  double depth_scale = 1;  // of the whole photo
  double focal = 1;
  Rigid3 camera_from_warped;  // after the warp and the drift
};

// The waves of the warp, in extents.
constexpr double kShortestWave = 1.5, kLongestWave = 4.5;

// Sky gets depths: the network has no word for "nothing". Far, smooth and unsure.
constexpr double kSkyDepthFactor = 2.0;

class PassSimulator {
 public:
  PassSimulator(const SceneTruth& truth, const std::vector<FrameRef>& frames,
                const ErrorModel& errors, uint64_t seed, uint64_t draw)
      : truth_(truth),
        errors_(errors.with_size_applied()),
        key_(mix64(seed, draw)),
        is_joint_(shows_both_epochs(frames)),
        pass_size_(pass_size(frames, is_joint_, errors_)),
        warp_(kShortestWave * truth.extent_m, kLongestWave * truth.extent_m,
              Random(key_, {kWarp})) {}

  std::vector<FrameErrors> draw_frame_errors(const std::vector<FrameRef>& frames) const {
    std::vector<FrameErrors> result;
    Random drift(key_, {kDrift}), focal(key_, {kFocal}), outlier(key_, {kOutlier}),
        scale(key_, {kScale});
    const double pass_focal = 1 + errors_.focal * focal.normal();
    for (size_t k = 0; k < frames.size(); ++k) {
      FrameErrors frame;
      const bool drawn = outlier.uniform() < errors_.outlier_share;
      const bool chosen = is_joint_ && static_cast<int>(k) <= errors_.outlier_keyframes;
      const bool out = k > 0 && (drawn || chosen);
      frame.size = out ? std::max(pass_size_, errors_.outlier_factor) : pass_size_;
      frame.focal = pass_focal + errors_.focal / 3 * focal.normal();
      const Vector3d turn{drift.normal(), drift.normal(), drift.normal()};
      const Vector3d shift{drift.normal(), drift.normal(), drift.normal()};
      displace_camera(frames[k], turn, shift, scale.normal(), frame);
      result.push_back(frame);
    }
    return result;
  }

  void predict_frame(const FrameRef& ref, const FrameErrors& frame, size_t index, float units,
                     Reconstruction& out) const {
    const EpochTruth& epoch = truth_.of(ref.epoch);
    const size_t per_frame = epoch.pixels_per_frame();
    const size_t source = static_cast<size_t>(ref.frame) * per_frame;
    std::vector<double> depth_m = warped_depth(ref);
    std::vector<double> ideal = depth_m;
    smear_edges(depth_m, epoch.width, epoch.height);

    const LowFrequency low(Random(key_, {kDepth, index}));
    const LowFrequency mood(Random(key_, {kConfidence, index}));
    Random pixel_noise(key_, {kPixel, index});
    for (int v = 0; v < epoch.height; ++v) {
      for (int u = 0; u < epoch.width; ++u) {
        const size_t pixel = static_cast<size_t>(v * epoch.width + u);
        const double us = static_cast<double>(u) / (epoch.width - 1);
        const double vs = static_cast<double>(v) / (epoch.height - 1);
        const bool sky = epoch.object[source + pixel] == 0;
        // Far things are known worse: twice the error at the scene's own size.
        const double far = 1 + std::min(2.0, depth_m[pixel] / truth_.extent_m);
        const double smooth =
            frame.size * errors_.depth_low_frequency * far * low.at(us, vs) * (sky ? 8.0 : 1.0);
        const double fine = errors_.depth_pixel * far * pixel_noise.normal();
        const double factor = frame.depth_scale * std::exp(smooth + fine);
        const double smeared = std::abs(std::log(depth_m[pixel] / ideal[pixel]));
        const double border = std::max(std::abs(us - 0.5), std::abs(vs - 0.5));  // 0.5 at the rim
        const double error = std::abs(smooth + fine) + smeared +
                             0.25 * std::abs(frame.depth_scale - 1) +
                             0.3 * errors_.depth_low_frequency * (far + 4 * border * border);
        const double unsure =
            errors_.confidence_noise * (mood.at(us, vs) + 0.5 * pixel_noise.normal());
        out.depth[index * per_frame + pixel] = static_cast<float>(units * depth_m[pixel] * factor);
        out.confidence[index * per_frame + pixel] =
            static_cast<float>(sky ? 1 + 0.05 * std::exp(unsure) : confidence(error, unsure));
      }
    }
    std::copy_n(epoch.color.begin() + static_cast<std::ptrdiff_t>(3 * source), 3 * per_frame,
                out.color.begin() + static_cast<std::ptrdiff_t>(3 * index * per_frame));
  }

 private:
  // 1 + exp(.) like the network's. Its training loss c |error| - alpha log c is least where c is
  // alpha / |error|.
  static double confidence(double relative_error, double unsure) {
    return 1 + std::exp(unsure) * 0.05 / (relative_error + 2e-3);
  }

  Vector3d warp_m(const Vector3d& x) const {
    return pass_size_ * errors_.warp * truth_.extent_m * warp_.value(x);
  }

  // The camera after the warp: it moves and turns with the world around it.
  Rigid3 warped_camera(const Rigid3& camera_from_world, const Vector3d& extra_shift_m,
                       const Eigen::Matrix3d& extra_turn) const {
    const Vector3d eye = camera_center(camera_from_world);
    const Eigen::Matrix3d turn =
        small_rotation(pass_size_ * errors_.warp * truth_.extent_m * warp_.turn(eye)) * extra_turn;
    Rigid3 result;
    result.rotation = camera_from_world.rotation * turn.transpose();
    result.translation = -(result.rotation * (eye + warp_m(eye) + extra_shift_m));
    return result;
  }

  static bool shows_both_epochs(const std::vector<FrameRef>& frames) {
    return std::ranges::any_of(
        frames, [&](const FrameRef& frame) { return frame.epoch != frames[0].epoch; });
  }

  // A multi-view estimate errs less the more photos see a place, down to what the network cannot do
  // better; photos of two states contradict each other wherever something changed.
  static double pass_size(const std::vector<FrameRef>& frames, bool both,
                          const ErrorModel& errors) {
    double count[2] = {};
    for (const FrameRef& frame : frames) ++count[static_cast<int>(frame.epoch)];
    const double per_epoch = both ? 0.5 * (count[0] + count[1]) : count[0] + count[1];
    return std::sqrt(1 + errors.few_views / per_epoch) * (both ? 1 + errors.two_states : 1.0);
  }

  // Distance at which the photo's surface weighs in its pose: parallax goes with inverse depth.
  double mean_parallax_depth_m(const FrameRef& ref) const {
    const EpochTruth& epoch = truth_.of(ref.epoch);
    const size_t first = static_cast<size_t>(ref.frame) * epoch.pixels_per_frame();
    double inverse = 0;
    int64_t count = 0;
    for (size_t pixel = first; pixel < first + epoch.pixels_per_frame(); ++pixel) {
      if (epoch.depth_m[pixel] <= 0) continue;
      inverse += 1 / static_cast<double>(epoch.depth_m[pixel]);
      ++count;
    }
    return count > 0 ? static_cast<double>(count) / inverse : truth_.extent_m;
  }

  // Drift: what a camera errs relative to what it sees. (What neighbours err alike is the warp: it
  // moves their surfaces too.) A misplaced camera that turns about what it sees, and takes its
  // forward shift off the depth, explains its photo nearly as well as the true one.
  // pose_depth_consistency is the correlation of rotation and depth scale with that; the rest of
  // their deviation is their own.
  void displace_camera(const FrameRef& ref, const Vector3d& turn, const Vector3d& shift,
                       double scale, FrameErrors& frame) const {
    const Rigid3& camera_from_world =
        truth_.of(ref.epoch).views[static_cast<size_t>(ref.frame)].camera_from_world;
    const Vector3d forward = camera_from_world.rotation.row(2).transpose();
    const Vector3d shift_m = frame.size * errors_.drift_translation * truth_.extent_m * shift;
    const Vector3d turn_rad =
        frame.size * errors_.drift_rotation_deg * std::numbers::pi / 180 * turn;
    const Vector3d shift_of_view = shift_m / mean_parallax_depth_m(ref);
    const double alike = errors_.pose_depth_consistency, apart = std::sqrt(1 - alike * alike);
    frame.depth_scale =
        1 + apart * frame.size * errors_.frame_scale * scale - alike * forward.dot(shift_of_view);
    frame.camera_from_warped =
        warped_camera(camera_from_world, shift_m,
                      small_rotation(apart * turn_rad - alike * forward.cross(shift_of_view)));
  }

  // The depth of the warped surface in the warped (not yet drifted) camera; sky far behind.
  std::vector<double> warped_depth(const FrameRef& ref) const {
    const EpochTruth& epoch = truth_.of(ref.epoch);
    const View& view = epoch.views[static_cast<size_t>(ref.frame)];
    const Rigid3 world_from_camera = view.camera_from_world.inverse();
    const Rigid3 camera_from_warped =
        warped_camera(view.camera_from_world, Vector3d::Zero(), Eigen::Matrix3d::Identity());
    const size_t first = static_cast<size_t>(ref.frame) * epoch.pixels_per_frame();
    std::vector<double> depth_m(epoch.pixels_per_frame());
    for (int v = 0; v < epoch.height; ++v) {
      for (int u = 0; u < epoch.width; ++u) {
        const size_t pixel = static_cast<size_t>(v * epoch.width + u);
        const double truth = epoch.depth_m[first + pixel];
        if (truth <= 0) {
          depth_m[pixel] = kSkyDepthFactor * truth_.extent_m;
          continue;
        }
        const Vector3d point = world_from_camera * view.pinhole.unproject(u, v, truth);
        depth_m[pixel] = std::max(0.01, (camera_from_warped * (point + warp_m(point))).z());
      }
    }
    return depth_m;
  }

  // Convolution heads smear depth across edges: points that fly between front and back. A tent
  // filter, applied only where its window spans more than 4 % of depth.
  void smear_edges(std::vector<double>& depth_m, int width, int height) const {
    const double radius_px = std::max(1.0, errors_.edge_blur_px * width / 518.0);
    const int reach = static_cast<int>(std::ceil(radius_px));
    if (errors_.edge_blur_px <= 0) return;
    const std::vector<double> sharp = depth_m;
    for (int v = 0; v < height; ++v) {
      for (int u = 0; u < width; ++u) {
        double low = 1e30, high = 0, sum = 0, weights = 0;
        for (int y = std::max(0, v - reach); y <= std::min(height - 1, v + reach); ++y) {
          for (int x = std::max(0, u - reach); x <= std::min(width - 1, u + reach); ++x) {
            const double d = sharp[static_cast<size_t>(y * width + x)];
            const double weight = std::max(0.0, 1 - std::hypot(x - u, y - v) / (radius_px + 0.5));
            low = std::min(low, d);
            high = std::max(high, d);
            sum += weight * d;
            weights += weight;
          }
        }
        if (high > 1.04 * low) depth_m[static_cast<size_t>(v * width + u)] = sum / weights;
      }
    }
  }

  const SceneTruth& truth_;
  ErrorModel errors_;
  uint64_t key_;
  bool is_joint_;
  double pass_size_;
  SmoothField warp_;
};

double mean_distance_m(const SceneTruth& truth, Epoch which) {
  const EpochTruth& epoch = truth.of(which);
  const Vector3d first_eye = camera_center(epoch.views[0].camera_from_world);
  double sum = 0;
  int64_t count = 0;
  for (size_t frame = 0; frame < epoch.views.size(); ++frame) {
    const Rigid3 world_from_camera = epoch.views[frame].camera_from_world.inverse();
    for (int v = 0; v < epoch.height; v += 8) {
      for (int u = 0; u < epoch.width; u += 8) {
        const double depth = epoch.depth_m[frame * epoch.pixels_per_frame() +
                                           static_cast<size_t>(v * epoch.width + u)];
        if (depth <= 0) continue;
        sum += (world_from_camera * epoch.views[frame].pinhole.unproject(u, v, depth) - first_eye)
                   .norm();
        ++count;
      }
    }
  }
  return sum / static_cast<double>(std::max<int64_t>(1, count));
}

std::vector<FrameRef> all_frames(const SceneTruth& truth, Epoch which) {
  std::vector<FrameRef> frames;
  for (int k = 0; k < truth.of(which).num_frames(); ++k) frames.push_back({which, k});
  return frames;
}

double units_per_metre(const SyntheticScene& scene, const SceneTruth& truth, uint64_t draw) {
  return (1 + 0.03 * Random(scene.key, {kScale, draw}).normal()) /
         mean_distance_m(truth, Epoch::kT1);
}

}  // namespace

ErrorModel ErrorModel::with_size_applied() const {
  ErrorModel larger = *this;
  larger.error_size = 1;
  for (double* size :
       {&larger.warp, &larger.depth_low_frequency, &larger.depth_pixel, &larger.frame_scale,
        &larger.drift_rotation_deg, &larger.drift_translation, &larger.focal}) {
    *size *= error_size;
  }
  return larger;
}

void ErrorModel::validate() const {
  for_each_field(*this, [](std::string_view name, const auto& value, std::string_view) {
    check_field(value >= 0, name, value, "at least 0");
  });
  check_field(pose_depth_consistency <= 1, "pose_depth_consistency", pose_depth_consistency,
              "at most 1");
  check_field(outlier_share < 1, "outlier_share", outlier_share, "below 1");
}

SimulatedPass simulate_pass(const SceneTruth& truth, const std::vector<FrameRef>& frames,
                            double units_per_metre, const ErrorModel& errors, uint64_t seed,
                            uint64_t draw) {
  check(!frames.empty(), "simulate_pass: no frames");
  const EpochTruth& any = truth.of(frames[0].epoch);
  const PassSimulator simulator(truth, frames, errors, seed, draw);
  const std::vector<FrameErrors> frame_errors = simulator.draw_frame_errors(frames);

  SimulatedPass pass;
  const Rigid3& first =
      truth.of(frames[0].epoch).views[static_cast<size_t>(frames[0].frame)].camera_from_world;
  pass.pass_from_world = {units_per_metre, first.rotation, units_per_metre * first.translation};
  // The pass anchors itself at its own first camera, errors included.
  const Rigid3& anchor = frame_errors[0].camera_from_warped;
  const Sim3 pass_from_warped{units_per_metre, anchor.rotation,
                              units_per_metre * anchor.translation};

  Reconstruction& out = pass.reconstruction;
  out.width = any.width;
  out.height = any.height;
  for (size_t k = 0; k < frames.size(); ++k) {
    const View& truth_view = truth.of(frames[k].epoch).views[static_cast<size_t>(frames[k].frame)];
    View view;
    view.name = truth_view.name;
    view.camera_from_world =
        camera_from_new_world(frame_errors[k].camera_from_warped, pass_from_warped);
    view.pinhole = truth_view.pinhole;
    view.pinhole.fx *= frame_errors[k].focal;
    view.pinhole.fy *= frame_errors[k].focal;
    // The network puts the principal point at (W/2, H/2), half a pixel from the centre.
    view.pinhole.cx = out.width / 2.0;
    view.pinhole.cy = out.height / 2.0;
    out.views.push_back(view);
  }
  out.depth.resize(out.num_pixels());
  out.confidence.resize(out.num_pixels());
  out.color.resize(3 * out.num_pixels());
  parallel_for(static_cast<int64_t>(frames.size()), 1, [&](int64_t index, int64_t) {
    const size_t k = static_cast<size_t>(index);
    simulator.predict_frame(frames[k], frame_errors[k], k, static_cast<float>(units_per_metre),
                            out);
  });
  check_consistent(out);
  return pass;
}

SimulatedPass simulate_joint(const SyntheticScene& scene, const SceneTruth& truth,
                             const std::vector<int>& keyframes_t1,
                             const std::vector<int>& keyframes_t2, const ErrorModel& errors) {
  std::vector<FrameRef> frames;
  for (const int frame : keyframes_t1) frames.push_back({Epoch::kT1, frame});
  for (const int frame : keyframes_t2) frames.push_back({Epoch::kT2, frame});
  const uint64_t draw = 3 + frames.size();  // another pass, other errors
  return simulate_pass(truth, frames, units_per_metre(scene, truth, draw), errors, scene.key, draw);
}

SimulatedPredictions simulate_predictions(const SyntheticScene& scene, const SceneTruth& truth,
                                          int keyframes, const ErrorModel& errors) {
  errors.validate();
  SimulatedPredictions result;
  const double t1_units = units_per_metre(scene, truth, 1);
  const double t2_units = t1_units * scene.scale_t2_from_t1;
  result.t1 = simulate_pass(truth, all_frames(truth, Epoch::kT1), t1_units, errors, scene.key, 1);
  result.t2 = simulate_pass(truth, all_frames(truth, Epoch::kT2), t2_units, errors, scene.key, 2);
  result.joint.keyframes_t1 = select_keyframes(truth.of(Epoch::kT1).num_frames(), keyframes);
  result.joint.keyframes_t2 = select_keyframes(truth.of(Epoch::kT2).num_frames(), keyframes);
  SimulatedPass joint =
      simulate_joint(scene, truth, result.joint.keyframes_t1, result.joint.keyframes_t2, errors);
  result.joint.reconstruction = std::move(joint.reconstruction);
  result.joint_from_world = joint.pass_from_world;
  return result;
}

}  // namespace vggtcd
