// SPDX-License-Identifier: Apache-2.0
// The colours of change, and each photo beside its change: a heat map of distances, or the answers
// of the votes.
#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "vggtcd/change/change_label.h"
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

// The colour of an answer, the report page's own (viewer/src/colormap.ts). Not for kNoEvidence,
// which has none.
std::array<uint8_t, 3> label_color(ChangeLabel label);

// The same picture where labels decide: right of the photo a dim grey one under the colours of the
// four answers, dim alone where there is no evidence; below them the legend. label is [height,
// width]. The greys of unchanged, unobserved and no evidence stay apart on any photo.
Image render_label_overlay(std::span<const uint8_t> rgb, std::span<const ChangeLabel> label,
                           int height, int width);

// Each pixel of a photo of this size is a square of so many pixels in the overlay, the photo's
// first one in the overlay's top left corner: read_results takes the photo from there.
int overlay_zoom(int width, int height);

}  // namespace vggtcd
