// SPDX-License-Identifier: Apache-2.0
// The colours of change: blue (static), green, yellow, red, and each photo beside its heat map.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "vggtcd/scene/image.h"

namespace vggtcd {

// fraction 0 is blue, 1/3 green, 2/3 yellow, 1 and above red, linear in between.
std::array<uint8_t, 3> heat_color(float fraction);

// The scale of a heat map; the same for all photos of a result.
struct HeatScale {
  double threshold_u = 0;  // tau, marked on the legend
  double bound_u = 0;      // red
};

// The photo, and right of it the same photo in dim grey with every pixel that has evidence (score
// not NaN) in its colour; below them the legend. Small photos are enlarged by a whole factor. rgb
// and score are [height, width, 3] and [height, width].
Image render_overlay(std::span<const uint8_t> rgb, std::span<const float> score, int height,
                     int width, const HeatScale& scale);

// Each pixel of a photo of this width is a square of so many pixels in the overlay, the photo's
// first one in the overlay's top left corner: read_results takes the photo from there.
int overlay_zoom(int width);

}  // namespace vggtcd
