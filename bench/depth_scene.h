// SPDX-License-Identifier: Apache-2.0
// A room seen by a ring of cameras at two times, as depth maps with the errors that depth networks
// make: material for benchmarks of full size, made in a second or two.
#pragma once

#include <cstdint>

#include "vggtcd/geometry/sim3.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd::bench {

struct DepthScene {
  Reconstruction before, after;  // each in a frame and scale of its own
  Sim3 t2_from_t1;               // exact
};

// frames per epoch, of 518 x 392 pixels. Between the epochs three of sixteen objects move and the
// cameras are elsewhere on their ring. Depth errors: a factor per frame (0.5 %), a smooth wave per
// frame (0.5 %), noise per pixel (0.2 %), and points hanging in the air between foreground and
// background (1 in 200).
DepthScene make_depth_scene(int frames, uint64_t seed);

}  // namespace vggtcd::bench
