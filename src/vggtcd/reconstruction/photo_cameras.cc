// SPDX-License-Identifier: Apache-2.0
// Which photos of an epoch share a camera: one folder may hold those of a phone's three lenses.
#include "vggtcd/reconstruction/photo_cameras.h"

#include <algorithm>
#include <string>

namespace vggtcd {

PhotoCameras photo_cameras(std::span<const Exif> photos) {
  constexpr double kSmallPictureSide_mm = 36;  // what "35 mm equivalent" refers to
  PhotoCameras result;
  std::vector<std::string> cameras;
  for (const Exif& photo : photos) {
    const std::string camera = photo.camera();
    const auto at = std::find(cameras.begin(), cameras.end(), camera);
    result.camera_of.push_back(static_cast<int>(at - cameras.begin()));
    if (at != cameras.end()) continue;
    cameras.push_back(camera);
    result.focal_of.push_back(photo.focal_35mm / kSmallPictureSide_mm);
  }
  if (cameras.size() == 1) result.focal_of.front() = 0;
  return result;
}

}  // namespace vggtcd
