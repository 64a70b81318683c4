// SPDX-License-Identifier: Apache-2.0
// Mesh: textured triangles of one object in its own frame, and the few solids scenes are built of.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "vggtcd/geometry/rigid3.h"

namespace vggtcd {

// Metres; z up; textures are fixed to the object's own coordinates, so they move with it.
struct Mesh {
  struct Vertex {
    Eigen::Vector3f position_m;
    Eigen::Vector3f normal;
    Eigen::Vector2f uv_m;
  };
  struct Triangle {
    std::array<uint32_t, 3> vertex;
    uint16_t material = 0;
    uint16_t face = 0;  // numbers the flat sides, so that no two posters are alike
  };
  std::vector<Vertex> vertices;
  std::vector<Triangle> triangles;
  uint16_t faces = 0;
};

// The pose of a thing that stands at (x, y, z), turned about the vertical.
Rigid3 at(double x_m, double y_m, double z_m, double yaw_deg = 0);
// A rotation about an axis through the origin.
Rigid3 turned(const Eigen::Vector3d& axis, double angle_deg);

// Each adds a closed solid (or a sheet) whose own frame is placed by object_from_part.
// A box around its centre.
void add_box(Mesh& mesh, const Rigid3& object_from_part, const Eigen::Vector3d& size_m,
             int material);
// A cylinder or cone along z from 0 to the height, with caps.
void add_cylinder(Mesh& mesh, const Rigid3& object_from_part, double bottom_radius_m,
                  double top_radius_m, double height_m, int material);
// An ellipsoid; `bumps` displaces it at random by that share of its radius (foliage, bushes).
void add_ellipsoid(Mesh& mesh, const Rigid3& object_from_part, const Eigen::Vector3d& radii_m,
                   int material, double bumps = 0, uint64_t seed = 0);
// A sheet z = height(x, y) over a rectangle, seen from above.
void add_heightfield(Mesh& mesh, const Eigen::Vector2d& low_m, const Eigen::Vector2d& high_m,
                     double spacing_m, int material,
                     const std::function<double(double, double)>& height_m);

}  // namespace vggtcd
