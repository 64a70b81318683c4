// SPDX-License-Identifier: Apache-2.0
// Points with surface normals, thinned to one per voxel: what surface registration works on.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

// Parallel arrays, positions and normals in the reconstruction's frame. Normals have length 1 and
// point towards the camera that saw the point.
struct OrientedPoints {
  std::vector<Eigen::Vector3f> positions;
  std::vector<Eigen::Vector3f> normals;
  std::vector<int32_t> frames;                                // the frame each point was taken from
  std::vector<Eigen::Vector3d> cameras;                       // the centre of every frame's camera
  Eigen::Vector3d origin_in_world = Eigen::Vector3d::Zero();  // the reconstruction's
  double voxel_size_u = 0;

  size_t size() const { return positions.size(); }
};

// The most confident pixel of each voxel (edge robust_extent / grid_resolution) among pixels above
// the confidence threshold whose surface normal is defined: a plane fitted to the depths in the
// square window of radius_px around the pixel that differ from its own by less than 5 %, if they
// are at least 60 % of the window and the plane is not seen at a grazing angle (cosine below 0.1).
OrientedPoints oriented_points(const Reconstruction& reconstruction, int grid_resolution,
                               int radius_px = 4);

}  // namespace vggtcd
