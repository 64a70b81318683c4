// SPDX-License-Identifier: Apache-2.0
// A toy reconstruction for tests: a few cameras looking at a bumpy relief, exact depth, in any
// frame.
#pragma once

#include <cstdint>
#include <functional>

#include "vggtcd/geometry/sim3.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd::testing_support {

// Two levels, and every place looks like many others.
uint8_t checkerboard(double x, double y);

struct ToyScene {
  int frames = 4;
  int width = 48, height = 36;
  double camera_offset = 0;  // shifts the walk, so that two epochs differ in viewpoints
  // Height of the relief over the plane z = 5 at (x, y), towards the cameras; must stay below 1.
  std::function<double(double x, double y)> relief = [](double, double) { return 0.0; };
  std::function<uint8_t(double x, double y)> gray = checkerboard;
};

// No place looks like another.
uint8_t mottled(double x, double y);

// What the tests of change compare: a plane, and a box 0.5 high on it (0.2 < x < 0.8, |y| < 0.3).
double flat_relief(double x, double y);
double box_relief(double x, double y);

// A similarity that no test can take for the identity: scale 1.7, all axes turned and moved.
extern const Sim3 kT2FromT1;

// Cameras walk along x at z = 0 and look towards +z. Depth by marching along the ray; confidence
// falls with the pixel's distance to the image centre; colour is the surface's gray. The
// world of the result is frame_from_scene * scene.
Reconstruction reconstruct(const ToyScene& scene, const Sim3& frame_from_scene);

}  // namespace vggtcd::testing_support
