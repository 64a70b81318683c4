// SPDX-License-Identifier: Apache-2.0
// The model that COLMAP's mapper writes (cameras.bin, images.bin, points3D.bin), points with tracks
// included. Source: COLMAP 3.8, "Binary File Format" of its documentation.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "vggtcd/geometry/rigid3.h"

namespace vggtcd {

// One focal length and one coefficient of radial distortion (COLMAP's SIMPLE_RADIAL, or with k = 0
// its SIMPLE_PINHOLE): a point x, y of the plane z = 1 is seen at f (1 + k r^2) x + cx, and the
// same for y.
struct RadialCamera {
  int width = 0, height = 0;
  double focal_px = 0;
  double cx = 0, cy = 0;  // px, pixel centres at integers
  double k = 0;
};

struct SfmView {
  std::string name;
  Rigid3 camera_from_world;
  RadialCamera camera;
};

struct SfmPoint {
  Eigen::Vector3d x_in_world;
  double error_px = 0;     // mean reprojection error
  std::vector<int> views;  // the views that see it, ascending, each once
};

struct SfmModel {
  std::vector<SfmView> views;  // by name
  std::vector<SfmPoint> points;
};

// Throws Error{kInput} naming the file if it is missing, cut off or of another camera model.
SfmModel read_colmap_model(const std::filesystem::path& folder);

}  // namespace vggtcd
