// SPDX-License-Identifier: Apache-2.0
// The scenes, one function each; make_scene (scene.h) finds them by name.
#pragma once

#include "vggtcd/evaluation/synthetic/scene_builder.h"

namespace vggtcd {

// What a scene function fills in besides the objects.
struct WalkPlan {
  Eigen::Vector3d centre_m{0, 0, 1};  // looked at
  double radius_m = 4;
  double from_deg = 0, to_deg = 120;  // direction of the eye from the centre
  double height_m = 1.6;
};
// Walks around the centre, the radius, height and target wavering by a few percent.
void arc_walk(SceneBuilder& b, Epoch epoch, int frames, const WalkPlan& plan);

// From one point to another, looking at points beside the way.
struct LinePlan {
  Eigen::Vector3d from_m, to_m, look_from_m, look_to_m;
};
void line_walk(SceneBuilder& b, Epoch epoch, int frames, const LinePlan& plan);

void build_driveway(SceneBuilder& b);
void build_courtyard(SceneBuilder& b);
void build_barbecue(SceneBuilder& b);
void build_poolside(SceneBuilder& b);
void build_street(SceneBuilder& b);

void build_coffee_corner(SceneBuilder& b);
void build_hallway(SceneBuilder& b);
void build_kitchen(SceneBuilder& b);
void build_living_room(SceneBuilder& b);
void build_desk(SceneBuilder& b);
void build_worktop(SceneBuilder& b);

void build_moving_day(SceneBuilder& b);

}  // namespace vggtcd
