// SPDX-License-Identifier: Apache-2.0
// What tells a thing that changed from an error of the depth: a thing has a body in several photos,
// errors are specks along edges.
#pragma once

#include <cstdint>
#include <span>

#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

struct ThingSigns {
  double pixel_confidence = 0;  // mean over its pixels, 0 to 1; 0.8 without votes
  double evidence = 0;          // mean gap in sigmas over its pixels, at most 8; 0 without votes
  double seen_through = 0;      // OwnTestimony of its own epoch
  double called_changed = 0;
  double fill = 0;           // voxels / those that cover the largest face of the box
  double length = 0;         // longest edge of the box / scene extent
  double width = 0;          // the second one / scene extent
  int photos = 0;            // that show it
  int photos_with_body = 0;  // of them, where a body is left
  double body = 0;           // share of its pixels that are in a body
  double at_edge = 0;        // share of its pixels beside a step in depth, or beside unknown depth
};

// A pixel is in a body if the square of 1/80 of the photo's width around it is the thing's; a photo
// shows a body if at least kMinBody pixels are. `members` are pixels of the epoch, ascending. Fills
// photos, photos_with_body, body and at_edge.
inline constexpr int64_t kMinBody = 10;
void add_body(const Reconstruction& epoch, std::span<const uint32_t> members, ThingSigns& signs);

// The probability, 0 to 1, that something changed there: a logistic function of pixel_confidence,
// seen_through, called_changed, the root of body, the logarithm of photos and at_edge, fitted to
// regions of generated scenes, of photos of generated scenes, and of real photos where nothing
// changed (bench/calibrate_things; how well it holds: docs/numerics.md).
double thing_probability(const ThingSigns& signs);

}  // namespace vggtcd
