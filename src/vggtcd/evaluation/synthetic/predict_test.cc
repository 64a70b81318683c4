// SPDX-License-Identifier: Apache-2.0
// The error model: nothing without errors, and each promise of docs/synthetic.md.
#include "vggtcd/evaluation/synthetic/predict.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "vggtcd/evaluation/synthetic/dataset.h"
#include "vggtcd/geometry/umeyama.h"
#include "vggtcd/scene/point_cloud.h"

namespace vggtcd {
namespace {

struct Case {
  SyntheticScene scene = make_scene("worktop", 4);
  SceneTruth truth;
  Case() {
    RenderOptions options;
    options.frames = 10;
    options.width = 130;
    options.photo_scale = 1;
    options.samples = 1;
    truth = render(scene, options, silent_progress());
  }
};
const Case& fixture() {
  static const Case instance;
  return instance;
}

ErrorModel no_errors() {
  ErrorModel errors;
  for_each_field(errors, [](std::string_view, auto& value, std::string_view) { value = 0; });
  errors.error_size = 1;
  return errors;
}

Eigen::Vector3d true_point(const EpochTruth& truth, size_t pixel) {
  const View& view = truth.views[pixel / truth.pixels_per_frame()];
  const size_t in_frame = pixel % truth.pixels_per_frame();
  const size_t width = static_cast<size_t>(truth.width);
  return view.camera_from_world.inverse() *
         view.pinhole.unproject(static_cast<double>(in_frame % width),
                                static_cast<double>(in_frame / width), truth.depth_m[pixel]);
}

TEST(SimulatePass, WithoutErrorsIsTheTruthInItsOwnFrame) {
  const SyntheticScene& scene = fixture().scene;
  const SceneTruth& truth = fixture().truth;
  SimulatedPredictions p = simulate_predictions(scene, truth, 3, no_errors());
  EXPECT_NEAR(p.t2_from_t1().scale, scene.scale_t2_from_t1, 1e-12);
  for (const Epoch which : kEpochs) {
    SimulatedPass& pass = which == Epoch::kT1 ? p.t1 : p.t2;
    // The first camera is the origin.
    EXPECT_LT(camera_center(pass.reconstruction.views[0].camera_from_world).norm(), 1e-12);
    // Undo the network's half pixel.
    for (View& view : pass.reconstruction.views) {
      view.pinhole.cx -= 0.5;
      view.pinhole.cy -= 0.5;
    }
    const EpochTruth& epoch = truth.of(which);
    for (size_t pixel = 0; pixel < epoch.depth_m.size(); pixel += 101) {
      const Eigen::Vector3d expected = pass.pass_from_world * true_point(epoch, pixel);
      const auto actual = unproject_pixel(pass.reconstruction, static_cast<uint32_t>(pixel));
      EXPECT_LT((actual.cast<double>() - expected).norm(), 1e-5);  // floats of a few units
    }
  }
}

TEST(SimulatePass, BestFitIsTheNominalSim3WithoutErrors) {
  const SyntheticScene& scene = fixture().scene;
  const SceneTruth& truth = fixture().truth;
  ErrorModel errors = no_errors();
  errors.confidence_noise = 0.3;  // else most confidences tie
  const SimulatedPredictions p = simulate_predictions(scene, truth, 3, errors);
  const Sim3 best = best_t2_from_t1(truth, p.t1.reconstruction, p.t2.reconstruction);
  const Sim3 off = best * p.t2_from_t1().inverse();
  // What is left is half a pixel of principal point, 1/210 of the depth.
  EXPECT_NEAR(off.scale, 1, 2e-3);
  EXPECT_LT(rotation_angle_rad(off.rotation), 5e-3);
  EXPECT_LT(off.translation.norm(), 5e-3);
}

std::vector<FrameRef> frames_of(Epoch which, int count) {
  std::vector<FrameRef> frames;
  for (int k = 0; k < count; ++k) frames.push_back({which, k});
  return frames;
}

TEST(SimulatePass, ErrsMoreWithFewPhotosAndWithTwoStates) {
  const auto& scene = fixture().scene;
  const auto& truth = fixture().truth;
  ErrorModel errors = no_errors();
  errors.drift_translation = 0.01;
  errors.few_views = 3;
  errors.two_states = 1;
  // How far off the second camera is, seen from the first; the draws are the same.
  const auto error_of = [&](std::vector<FrameRef> frames) {
    const SimulatedPass pass = simulate_pass(truth, frames, 1.0, errors, scene.key, 1);
    const View& view = truth.of(Epoch::kT1).views[1];
    return (camera_center(pass.reconstruction.views[1].camera_from_world) -
            pass.pass_from_world * camera_center(view.camera_from_world))
        .norm();
  };
  std::vector<FrameRef> both = frames_of(Epoch::kT1, 5);
  for (const FrameRef& frame : frames_of(Epoch::kT2, 5)) both.push_back(frame);
  const double five = error_of(frames_of(Epoch::kT1, 5)), ten = error_of(frames_of(Epoch::kT1, 10));
  EXPECT_NEAR(five / ten, std::sqrt((1 + 3.0 / 5) / (1 + 3.0 / 10)), 1e-9);
  EXPECT_NEAR(error_of(both) / five, 2, 1e-9);
}

TEST(SimulatePass, PointsStayInPlaceWhenPoseAndDepthAgree) {
  const SyntheticScene& scene = fixture().scene;
  const SceneTruth& truth = fixture().truth;
  const EpochTruth& epoch = truth.of(Epoch::kT1);
  // What is left of the points' errors after the best similarity, relative to the cameras'.
  const auto points_against_cameras = [&](double consistency) {
    ErrorModel errors = no_errors();
    errors.drift_translation = 0.01;
    errors.pose_depth_consistency = consistency;
    SimulatedPass pass = simulate_pass(truth, frames_of(Epoch::kT1, 10), 1.0, errors, scene.key, 1);
    std::vector<Eigen::Vector3d> points, true_points, eyes, true_eyes;
    for (View& view : pass.reconstruction.views) {
      view.pinhole.cx -= 0.5;  // undo the network's half pixel
      view.pinhole.cy -= 0.5;
    }
    for (size_t pixel = 0; pixel < epoch.depth_m.size(); pixel += 101) {
      if (epoch.depth_m[pixel] <= 0) continue;
      points.push_back(
          unproject_pixel(pass.reconstruction, static_cast<uint32_t>(pixel)).cast<double>());
      true_points.push_back(true_point(epoch, pixel));
    }
    for (size_t k = 0; k < epoch.views.size(); ++k) {
      eyes.push_back(camera_center(pass.reconstruction.views[k].camera_from_world));
      true_eyes.push_back(camera_center(epoch.views[k].camera_from_world));
    }
    return umeyama(points, true_points).rms / umeyama(eyes, true_eyes).rms;
  };
  // Rigid photos carry their points along by as much as their cameras err; turning about what they
  // see, only parallax is left.
  EXPECT_GT(points_against_cameras(0), 0.7);
  EXPECT_LT(points_against_cameras(1), 0.5 * points_against_cameras(0));
}

TEST(SimulatePass, EachPassDrawsItsOwnErrors) {
  const SyntheticScene& scene = fixture().scene;
  const SceneTruth& truth = fixture().truth;
  const SimulatedPredictions p = simulate_predictions(scene, truth, 3, ErrorModel{});
  // Frame 0 of T1 is frame 0 of the joint pass too; scales differ, so compare depth ratios.
  const float scale = p.joint.reconstruction.depth[0] / p.t1.reconstruction.depth[0];
  double spread = 0;
  for (size_t pixel = 0; pixel < truth.of(Epoch::kT1).pixels_per_frame(); ++pixel) {
    const double ratio = p.joint.reconstruction.depth[pixel] / p.t1.reconstruction.depth[pixel];
    spread = std::max(spread, std::abs(ratio / scale - 1));
  }
  EXPECT_GT(spread, 0.01);
}

TEST(SimulatePass, ErrorsDifferFromSeedToSeed) {
  // Relative depth errors of the first frame, as two variants of one scene draw them: uncorrelated.
  const auto first_errors = [](uint64_t seed) {
    const SyntheticScene scene = make_scene("worktop", seed);
    RenderOptions options;
    options.frames = 2;
    options.width = 64;
    options.photo_scale = options.samples = 1;
    const SceneTruth truth = render(scene, options, silent_progress());
    const SimulatedPredictions p = simulate_predictions(scene, truth, 2, ErrorModel{});
    std::vector<double> errors;
    for (size_t k = 0; k < truth.of(Epoch::kT1).pixels_per_frame(); ++k) {
      errors.push_back(std::log(p.t1.reconstruction.depth[k] / p.t1.pass_from_world.scale /
                                truth.of(Epoch::kT1).depth_m[k]));
    }
    return errors;
  };
  const std::vector<double> a = first_errors(1), b = first_errors(2);
  double difference = 0, size = 0;
  for (size_t k = 0; k < a.size(); ++k) {
    difference += std::abs(a[k] - b[k]);
    size += std::abs(a[k]) + std::abs(b[k]);
  }
  EXPECT_GT(difference, 0.3 * size);
}

// Rank correlation by Spearman.
double rank_correlation(const std::vector<double>& a, const std::vector<double>& b) {
  const auto ranks = [](const std::vector<double>& values) {
    std::vector<size_t> order(values.size());
    std::iota(order.begin(), order.end(), size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](size_t x, size_t y) { return values[x] < values[y]; });
    std::vector<double> rank(values.size());
    for (size_t k = 0; k < order.size(); ++k) rank[order[k]] = static_cast<double>(k);
    return rank;
  };
  const std::vector<double> ra = ranks(a), rb = ranks(b);
  const double mean = 0.5 * static_cast<double>(a.size() - 1);
  double cross = 0, square = 0;
  for (size_t k = 0; k < a.size(); ++k) {
    cross += (ra[k] - mean) * (rb[k] - mean);
    square += (ra[k] - mean) * (ra[k] - mean);
  }
  return cross / square;
}

TEST(SimulatePass, ConfidenceAnticorrelatesWithErrorButDoesNotTellIt) {
  const SyntheticScene& scene = fixture().scene;
  const SceneTruth& truth = fixture().truth;
  std::vector<FrameRef> frames;
  for (int k = 0; k < 10; ++k) frames.push_back({Epoch::kT1, k});
  const EpochTruth& epoch = truth.of(Epoch::kT1);
  double mean = 0;
  for (const uint64_t draw : {1u, 2u, 3u, 4u, 5u, 6u}) {
    const SimulatedPass pass = simulate_pass(truth, frames, 0.5, ErrorModel{}, scene.key, draw);
    std::vector<double> errors, confidences;
    for (size_t pixel = 0; pixel < epoch.depth_m.size(); ++pixel) {
      const double depth = pass.reconstruction.depth[pixel] / 0.5;
      errors.push_back(std::abs(std::log(depth / epoch.depth_m[pixel])));
      confidences.push_back(pass.reconstruction.confidence[pixel]);
      EXPECT_GE(confidences.back(), 1.0);
    }
    mean += rank_correlation(errors, confidences) / 6;
  }
  EXPECT_LT(mean, -0.2);
  EXPECT_GT(mean, -0.8);
}

TEST(SimulatePass, EdgesHavePointsThatFlyBetweenFrontAndBack) {
  const SyntheticScene& scene = fixture().scene;
  const SceneTruth& truth = fixture().truth;
  ErrorModel errors = no_errors();
  errors.edge_blur_px = 1.5;
  const SimulatedPredictions p = simulate_predictions(scene, truth, 3, errors);
  const EpochTruth& epoch = truth.of(Epoch::kT1);
  int flying = 0, altered_inside = 0;
  const int w = epoch.width;
  for (int v = 2; v < epoch.height - 2; ++v) {
    for (int u = 2; u < w - 2; ++u) {
      const auto at_pixel = [&](int du, int dv) {
        return epoch.depth_m[static_cast<size_t>((v + dv) * w + u + du)];
      };
      float low = at_pixel(0, 0), high = low;
      for (int dv = -2; dv <= 2; ++dv) {
        for (int du = -2; du <= 2; ++du) {
          low = std::min(low, at_pixel(du, dv));
          high = std::max(high, at_pixel(du, dv));
        }
      }
      const double depth =
          p.t1.reconstruction.depth[static_cast<size_t>(v * w + u)] / p.t1.pass_from_world.scale;
      if (high > 1.3f * low) flying += depth > 1.1 * low && depth < high / 1.1 ? 1 : 0;
      if (high < 1.03f * low) altered_inside += std::abs(depth / at_pixel(0, 0) - 1) > 1e-5 ? 1 : 0;
    }
  }
  EXPECT_GT(flying, 30);
  EXPECT_EQ(altered_inside, 0);
}

TEST(SimulatePass, OutlierFramesAreFarOffAndLessSure) {
  const SyntheticScene& scene = fixture().scene;
  const SceneTruth& truth = fixture().truth;
  ErrorModel errors;
  errors.outlier_share = 0.5;
  const SimulatedPredictions p = simulate_predictions(scene, truth, 3, errors);
  const SimulatedPredictions calm = [&] {
    ErrorModel none = errors;
    none.outlier_share = 0;
    return simulate_predictions(scene, truth, 3, none);
  }();
  int outliers = 0;
  for (size_t frame = 0; frame < 10; ++frame) {
    const auto eye = [&](const SimulatedPredictions& q) {
      return camera_center(q.t1.reconstruction.views[frame].camera_from_world);
    };
    const double moved = (eye(p) - eye(calm)).norm() / p.t1.pass_from_world.scale;
    if (moved > 1e-9) {
      ++outliers;
      const auto mean = [&](const SimulatedPredictions& q) {
        const auto values = q.t1.reconstruction.frame_confidence(static_cast<int>(frame));
        return std::accumulate(values.begin(), values.end(), 0.0);
      };
      EXPECT_LT(mean(p), mean(calm));
    }
  }
  EXPECT_GE(outliers, 2);
  EXPECT_LE(outliers, 8);
}

// How far the cameras of a pass differ, in metres.
double moved_m(const Reconstruction& a, const Reconstruction& b, size_t frame,
               double units_per_metre) {
  return (camera_center(a.views[frame].camera_from_world) -
          camera_center(b.views[frame].camera_from_world))
             .norm() /
         units_per_metre;
}

TEST(SimulatePass, OutlierKeyframesGoWrongInTheJointPassAlone) {
  const auto& [scene, truth] = fixture();
  ErrorModel errors;
  errors.outlier_share = 0;
  const SimulatedPredictions calm = simulate_predictions(scene, truth, 4, errors);
  errors.outlier_keyframes = 2;
  const SimulatedPredictions wild = simulate_predictions(scene, truth, 4, errors);
  for (size_t frame = 0; frame < 8; ++frame) {
    const double moved = moved_m(wild.joint.reconstruction, calm.joint.reconstruction, frame,
                                 calm.joint_from_world.scale);
    if (frame == 1 || frame == 2) {
      EXPECT_GT(moved, 1e-4) << frame;
    } else {
      EXPECT_LT(moved, 1e-9) << frame;
    }
    EXPECT_LT(moved_m(wild.t1.reconstruction, calm.t1.reconstruction, frame, 1), 1e-12);
  }
}

TEST(SimulatePass, ErrorsAreTwiceAsLargeWhereAskedFor) {
  const auto& [scene, truth] = fixture();
  ErrorModel errors = no_errors();
  errors.drift_translation = 0.002;
  const SimulatedPredictions none = simulate_predictions(scene, truth, 3, no_errors());
  const SimulatedPredictions once = simulate_predictions(scene, truth, 3, errors);
  errors.error_size = 2;
  const SimulatedPredictions twice = simulate_predictions(scene, truth, 3, errors);
  const auto from_none = [&](const SimulatedPredictions& p) {
    // The pass stands in the frame of its first camera, which drifts too: compare what is between.
    double sum = 0;
    for (size_t frame = 1; frame < 10; ++frame) {
      sum += moved_m(p.t1.reconstruction, none.t1.reconstruction, frame, 1);
    }
    return sum;
  };
  EXPECT_NEAR(from_none(twice), 2 * from_none(once), 0.02 * from_none(twice));
}

// The mean step in grey from a pixel to the next one.
double contrast(SceneTexture texture) {
  const SyntheticScene scene = make_scene("kitchen", 4, SceneChange::kScene, texture);
  RenderOptions options;
  options.frames = 2;
  options.width = 130;
  options.photo_scale = 1;
  options.samples = 1;
  const EpochTruth epoch = render(scene, options, silent_progress()).of(Epoch::kT1);
  double sum = 0;
  for (size_t i = 3; i < epoch.color.size(); i += 3) {
    sum += std::abs(int{epoch.color[i]} - int{epoch.color[i - 3]});
  }
  return sum / static_cast<double>(epoch.color.size() / 3);
}

TEST(SceneTexture, NoneIsPlainAndOneIsNot) {
  EXPECT_LT(contrast(SceneTexture::kNone), 0.7 * contrast(SceneTexture::kScene));
  EXPECT_GT(contrast(SceneTexture::kOne), 1.3 * contrast(SceneTexture::kNone));
}

}  // namespace
}  // namespace vggtcd
