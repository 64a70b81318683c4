// SPDX-License-Identifier: Apache-2.0
// What a reconstruction network would have said: the truth with errors like a network's
// (docs/synthetic.md gives the reasons for each term and its size).
#pragma once

#include <vector>

#include "vggtcd/core/options.h"
#include "vggtcd/evaluation/synthetic/render.h"
#include "vggtcd/geometry/sim3.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

// Standard deviations unless said otherwise; "of the extent": relative to SceneTruth::extent_m.
// Warp, drift, frame_scale and depth_low_frequency are those of a pass with many photos of one
// state; few_views and two_states say how they grow.
struct ErrorModel {
  double warp = 0.006;
  double depth_low_frequency = 0.010;
  double depth_pixel = 0.002;
  double frame_scale = 0.006;
  double drift_rotation_deg = 0.25;
  double drift_translation = 0.002;
  double pose_depth_consistency = 0.7;
  double few_views = 3.0;
  double two_states = 2.0;
  double focal = 0.006;
  double edge_blur_px = 1.5;
  double confidence_noise = 0.35;
  double outlier_share = 0.03;
  double outlier_factor = 8.0;
  int outlier_keyframes = 0;
  double error_size = 1;

  static constexpr auto fields = [](auto&& self, auto&& field) {
    field("warp", self.warp, "smooth deformation of the whole pass, of the extent");
    field("depth_low_frequency", self.depth_low_frequency,
          "relative depth error per frame that varies over about a quarter of the photo");
    field("depth_pixel", self.depth_pixel, "relative depth error per pixel");
    field("frame_scale", self.frame_scale, "relative depth scale per frame");
    field("drift_rotation_deg", self.drift_rotation_deg, "error of a camera's rotation");
    field("drift_translation", self.drift_translation, "error of a camera's place, of the extent");
    field("pose_depth_consistency", self.pose_depth_consistency,
          "how far a photo's rotation and depth make up for its camera's misplacement, so that its "
          "points stay where they are; 0: independent errors, 1: to first order");
    field("few_views", self.few_views,
          "errors of a pass grow by sqrt(1 + this / photos per epoch)");
    field("two_states", self.two_states,
          "by how much the errors of a pass grow in that half of its photos show another state");
    field("focal", self.focal, "relative focal length of the pass; a third of it per frame");
    field("edge_blur_px", self.edge_blur_px,
          "depth is smeared over this many px of a 518 px photo at depth edges");
    field("confidence_noise", self.confidence_noise,
          "what confidence does not know about the error, in natural log units");
    field("outlier_share", self.outlier_share, "share of frames that go wrong, never the first");
    field("outlier_factor", self.outlier_factor, "by how much an outlier's errors are larger");
    field("outlier_keyframes", self.outlier_keyframes,
          "photos of the joint pass that go wrong for certain, from the second on");
    field("error_size", self.error_size,
          "all errors of depths, cameras and intrinsics are this many times as large");
  };
  void validate() const;
  ErrorModel with_size_applied() const;  // error_size is 1 then
};

struct FrameRef {
  Epoch epoch;
  int frame;
};

// One forward pass over these frames.
struct SimulatedPass {
  Reconstruction reconstruction;
  // Where the pass would put the world if it made no errors: its first camera at the origin, in
  // its own units.
  Sim3 pass_from_world;
};

// `units_per_metre` is the scale of the pass; `draw` selects the errors, so that two passes over
// the same frames differ. All errors depend on (seed, draw, position in the list, place) alone.
SimulatedPass simulate_pass(const SceneTruth& truth, const std::vector<FrameRef>& frames,
                            double units_per_metre, const ErrorModel& errors, uint64_t seed,
                            uint64_t draw);

// The three passes of a bi-temporal scene.
struct SimulatedPredictions {
  SimulatedPass t1, t2;
  JointReconstruction joint;
  Sim3 joint_from_world;

  Sim3 t2_from_t1() const { return t2.pass_from_world * t1.pass_from_world.inverse(); }
};

// The scale of each pass: like the network's training, the mean distance of its points to its first
// camera is 1, give or take 3 percent; T2's follows from the scene's ratio.
SimulatedPredictions simulate_predictions(const SyntheticScene& scene, const SceneTruth& truth,
                                          int keyframes, const ErrorModel& errors);
// Only the joint pass, for other numbers of keyframes. Equal to simulate_predictions' for the same.
SimulatedPass simulate_joint(const SyntheticScene& scene, const SceneTruth& truth,
                             const std::vector<int>& keyframes_t1,
                             const std::vector<int>& keyframes_t2, const ErrorModel& errors);

}  // namespace vggtcd
