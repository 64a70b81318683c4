// SPDX-License-Identifier: Apache-2.0
// The solids that generated scenes are built of.
#include "vggtcd/evaluation/synthetic/mesh.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "vggtcd/evaluation/synthetic/random.h"

namespace vggtcd {
namespace {

constexpr double kPi = std::numbers::pi;

uint32_t add_vertex(Mesh& mesh, const Rigid3& object_from_part, const Eigen::Vector3d& position,
                    const Eigen::Vector3d& normal, double u, double v) {
  mesh.vertices.push_back({(object_from_part * position).cast<float>(),
                           (object_from_part.rotation * normal).normalized().cast<float>(),
                           Eigen::Vector2d(u, v).cast<float>()});
  return static_cast<uint32_t>(mesh.vertices.size() - 1);
}

void add_triangle(Mesh& mesh, uint32_t a, uint32_t b, uint32_t c, int material) {
  mesh.triangles.push_back({{a, b, c}, static_cast<uint16_t>(material), mesh.faces});
}

void add_quad(Mesh& mesh, uint32_t a, uint32_t b, uint32_t c, uint32_t d, int material) {
  add_triangle(mesh, a, b, c, material);
  add_triangle(mesh, a, c, d, material);
}

// Rings of (segments + 1) vertices each, joined by quads.
void join_rings(Mesh& mesh, uint32_t first, int rings, int segments, int material) {
  const uint32_t stride = static_cast<uint32_t>(segments) + 1;
  for (uint32_t ring = 0; ring + 1 < static_cast<uint32_t>(rings); ++ring) {
    for (uint32_t k = 0; k + 1 < stride; ++k) {
      const uint32_t a = first + ring * stride + k;
      add_quad(mesh, a, a + 1, a + stride + 1, a + stride, material);
    }
  }
}

}  // namespace

Rigid3 at(double x_m, double y_m, double z_m, double yaw_deg) {
  Rigid3 pose = turned(Eigen::Vector3d::UnitZ(), yaw_deg);
  pose.translation = {x_m, y_m, z_m};
  return pose;
}

Rigid3 turned(const Eigen::Vector3d& axis, double angle_deg) {
  Rigid3 pose;
  pose.rotation = Eigen::AngleAxisd(angle_deg * kPi / 180.0, axis.normalized()).toRotationMatrix();
  return pose;
}

void add_box(Mesh& mesh, const Rigid3& object_from_part, const Eigen::Vector3d& size_m,
             int material) {
  for (int axis = 0; axis < 3; ++axis) {
    const int u_axis = axis == 0 ? 1 : 0;
    const int v_axis = axis == 2 ? 1 : 2;
    for (const double side : {-0.5, 0.5}) {
      Eigen::Vector3d normal = Eigen::Vector3d::Zero();
      normal[axis] = side;
      uint32_t corner[4];
      for (int k = 0; k < 4; ++k) {
        const double u = (k == 1 || k == 2 ? 0.5 : -0.5) * size_m[u_axis];
        const double v = (k >= 2 ? 0.5 : -0.5) * size_m[v_axis];
        Eigen::Vector3d position;
        position[axis] = side * size_m[axis];
        position[u_axis] = u;
        position[v_axis] = v;
        corner[k] = add_vertex(mesh, object_from_part, position, normal, u, v);
      }
      ++mesh.faces;
      add_quad(mesh, corner[0], corner[1], corner[2], corner[3], material);
    }
  }
}

void add_cylinder(Mesh& mesh, const Rigid3& object_from_part, double bottom_radius_m,
                  double top_radius_m, double height_m, int material) {
  constexpr int kSegments = 24;
  const double slope = (bottom_radius_m - top_radius_m) / height_m;
  ++mesh.faces;
  const uint32_t side = static_cast<uint32_t>(mesh.vertices.size());
  for (const double z : {0.0, height_m}) {
    const double radius = z == 0 ? bottom_radius_m : top_radius_m;
    for (int k = 0; k <= kSegments; ++k) {
      const double angle = 2 * kPi * k / kSegments;
      const Eigen::Vector3d out(std::cos(angle), std::sin(angle), slope);
      add_vertex(mesh, object_from_part, {radius * out.x(), radius * out.y(), z}, out,
                 angle * std::max(bottom_radius_m, top_radius_m), z);
    }
  }
  join_rings(mesh, side, 2, kSegments, material);
  for (const double z : {0.0, height_m}) {
    const double radius = z == 0 ? bottom_radius_m : top_radius_m;
    const Eigen::Vector3d normal(0, 0, z == 0 ? -1 : 1);
    ++mesh.faces;
    const uint32_t centre = add_vertex(mesh, object_from_part, {0, 0, z}, normal, 0, 0);
    for (int k = 0; k <= kSegments; ++k) {
      const double angle = 2 * kPi * k / kSegments;
      const double x = radius * std::cos(angle), y = radius * std::sin(angle);
      const uint32_t rim = add_vertex(mesh, object_from_part, {x, y, z}, normal, x, y);
      if (k > 0) add_triangle(mesh, centre, rim - 1, rim, material);
    }
  }
}

void add_ellipsoid(Mesh& mesh, const Rigid3& object_from_part, const Eigen::Vector3d& radii_m,
                   int material, double bumps, uint64_t seed) {
  constexpr int kRings = 17, kSegments = 24;
  ++mesh.faces;
  const uint32_t first = static_cast<uint32_t>(mesh.vertices.size());
  for (int ring = 0; ring < kRings; ++ring) {
    const double polar = kPi * ring / (kRings - 1);
    for (int k = 0; k <= kSegments; ++k) {
      const double angle = 2 * kPi * k / kSegments;
      const Eigen::Vector3d out(std::sin(polar) * std::cos(angle),
                                std::sin(polar) * std::sin(angle), std::cos(polar));
      // The seam and the poles must meet: the displacement depends on the direction alone.
      const bool pole = ring == 0 || ring == kRings - 1;
      Random random(seed,
                    {static_cast<uint64_t>(ring), pole ? 0 : static_cast<uint64_t>(k % kSegments)});
      const double grow = 1.0 + bumps * random.uniform(-1, 1);
      add_vertex(mesh, object_from_part, grow * out.cwiseProduct(radii_m),
                 out.cwiseQuotient(radii_m), angle * radii_m.x(), polar * radii_m.z());
    }
  }
  join_rings(mesh, first, kRings, kSegments, material);
}

void add_heightfield(Mesh& mesh, const Eigen::Vector2d& low_m, const Eigen::Vector2d& high_m,
                     double spacing_m, int material,
                     const std::function<double(double, double)>& height_m) {
  const Eigen::Vector2d size = high_m - low_m;
  const int columns = std::max(1, static_cast<int>(std::lround(size.x() / spacing_m)));
  const int rows = std::max(1, static_cast<int>(std::lround(size.y() / spacing_m)));
  ++mesh.faces;
  const uint32_t first = static_cast<uint32_t>(mesh.vertices.size());
  for (int row = 0; row <= rows; ++row) {
    for (int column = 0; column <= columns; ++column) {
      const double x = low_m.x() + size.x() * column / columns;
      const double y = low_m.y() + size.y() * row / rows;
      const double h = 0.01;
      const Eigen::Vector3d normal(height_m(x - h, y) - height_m(x + h, y),
                                   height_m(x, y - h) - height_m(x, y + h), 2 * h);
      add_vertex(mesh, {}, {x, y, height_m(x, y)}, normal, x, y);
    }
  }
  join_rings(mesh, first, rows + 1, columns, material);
}

}  // namespace vggtcd
