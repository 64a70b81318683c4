// SPDX-License-Identifier: Apache-2.0
// Which photos of an epoch share a camera, and what is known of its focal length.
#pragma once

#include <span>
#include <vector>

#include "vggtcd/io/exif.h"

namespace vggtcd {

struct PhotoCameras {
  std::vector<int> camera_of;  // of each photo, from 0 in the order of first appearance
  // Of each camera, in units of the longer side; 0 where it has to be guessed. All 0 for one
  // camera: its focal length is found from the photos.
  std::vector<double> focal_of;
};

// Two photos share a camera if device, lens, focal length and zoom are the same in EXIF.
PhotoCameras photo_cameras(std::span<const Exif> photos);

}  // namespace vggtcd
