// SPDX-License-Identifier: Apache-2.0
// Photos as an ideal camera would have taken them, all of one size.
#pragma once

#include "vggtcd/reconstruction/colmap_model.h"
#include "vggtcd/reconstruction/plane_sweep.h"
#include "vggtcd/scene/image.h"

namespace vggtcd {

// The frame of the given size that a photo of this camera fills: one focal length, scaled as the
// photo must be to cover the frame; the principal point stays where it was relative to the middle.
Pinhole covering_pinhole(const RadialCamera& camera, int width, int height);

struct UndistortedPhoto {
  Image color;
  std::vector<uint8_t> valid;  // [H, W], 0 where the photo does not reach
};

// Resampled bilinearly from the photo, reduced first so that nothing aliases.
UndistortedPhoto undistort(const Image& photo, const RadialCamera& camera, const Pinhole& pinhole);

// Brightness, for plane_sweep.h.
std::vector<float> brightness(const Image& image);

}  // namespace vggtcd
