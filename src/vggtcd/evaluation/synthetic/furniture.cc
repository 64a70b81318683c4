// SPDX-License-Identifier: Apache-2.0
// The things in generated scenes, assembled from boxes, cylinders and ellipsoids.
#include <numbers>

#include "vggtcd/evaluation/synthetic/scene_builder.h"

namespace vggtcd {
namespace {

using Eigen::Vector3d;

const Vector3d kX = Vector3d::UnitX();

// Four legs under a rectangle.
void add_legs(Mesh& mesh, double width, double depth, double height, double thickness,
              int material) {
  for (const double x : {-0.5, 0.5}) {
    for (const double y : {-0.5, 0.5}) {
      add_box(mesh, at(x * (width - 2 * thickness), y * (depth - 2 * thickness), height / 2),
              {thickness, thickness, height}, material);
    }
  }
}

}  // namespace

void SceneBuilder::add_leaves(Mesh& mesh, int leaves, double radius_m, double spread_m,
                              double height_m) {
  const double x = spread_m * random.uniform(-1, 1);
  const double y = spread_m * random.uniform(-1, 1);
  add_ellipsoid(mesh, at(x, y, height_m), {radius_m, radius_m, 0.8 * radius_m}, leaves, 0.15,
                random.next());
}

Mesh SceneBuilder::table(const Vector3d& size_m) {
  Mesh mesh;
  const int top = wood();
  add_box(mesh, at(0, 0, size_m.z() - 0.02), {size_m.x(), size_m.y(), 0.04}, top);
  add_legs(mesh, size_m.x(), size_m.y(), size_m.z() - 0.04, 0.06, top);
  return mesh;
}

Mesh SceneBuilder::chair() {
  Mesh mesh;
  const int frame = wood(), seat = fabric();
  add_legs(mesh, 0.46, 0.46, 0.43, 0.04, frame);
  add_box(mesh, at(0, 0, 0.455), {0.46, 0.46, 0.05}, seat);
  for (const double x : {-0.19, 0.19}) add_box(mesh, at(x, 0.2, 0.7), {0.04, 0.04, 0.5}, frame);
  add_box(mesh, at(0, 0.2, 0.82), {0.42, 0.03, 0.24}, seat);
  return mesh;
}

Mesh SceneBuilder::sofa(double width_m) {
  Mesh mesh;
  const int body = fabric(), cushion = fabric(), print = poster(0.3);
  add_box(mesh, at(0, 0, 0.22), {width_m, 0.9, 0.34}, body);
  add_box(mesh, at(0, 0.36, 0.6), {width_m, 0.2, 0.5}, body);
  for (const double side : {-0.5, 0.5}) {
    add_box(mesh, at(side * (width_m - 0.18), 0, 0.45), {0.18, 0.9, 0.3}, body);
  }
  const int seats = 2 + static_cast<int>(width_m > 1.9);
  for (int k = 0; k < seats; ++k) {
    const double x = (width_m - 0.4) * ((k + 0.5) / seats - 0.5);
    add_box(mesh, at(x, -0.05, 0.45), {(width_m - 0.42) / seats, 0.7, 0.14}, cushion);
    add_box(mesh, at(x, 0.2, 0.68) * turned(kX, -15), {0.42, 0.12, 0.4}, k == 1 ? cushion : print);
  }
  return mesh;
}

Mesh SceneBuilder::cupboard(const Vector3d& size_m, bool with_front) {
  Mesh mesh;
  const double x = size_m.x(), y = size_m.y(), z = size_m.z(), t = 0.02;
  const int side = wood();
  add_box(mesh, at(0, y / 2 - t / 2, z / 2), {x, t, z}, side);
  for (const double s : {-0.5, 0.5}) {
    add_box(mesh, at(s * (x - t), 0, z / 2), {t, y, z}, side);
    add_box(mesh, at(0, 0, z / 2 + s * (z - t)), {x, y, t}, side);
  }
  add_box(mesh, at(0, 0.02, z / 2), {x, y - 0.06, t}, side);
  const int inside = books();
  add_box(mesh, at(0.05 * x, 0.08 * y, 0.2 * z), {0.7 * x, 0.5 * y, 0.32 * z}, inside);
  if (with_front) {
    const int front = paint(), handle = metal();
    const int doors = std::max(1, static_cast<int>(x / 0.5));
    for (int k = 0; k < doors; ++k) {
      const double u = x * ((k + 0.5) / doors - 0.5);
      add_box(mesh, at(u, -y / 2 - 0.01, z / 2), {x / doors - 0.01, 0.02, z - 0.01}, front);
      add_box(mesh, at(u + 0.35 * x / doors, -y / 2 - 0.035, 0.75 * z), {0.015, 0.03, 0.14},
              handle);
    }
  }
  return mesh;
}

Mesh SceneBuilder::door_panel(double width_m, double height_m, int material_index) {
  Mesh mesh;
  const int handle = metal();
  add_box(mesh, at(width_m / 2, 0, height_m / 2), {width_m, 0.03, height_m}, material_index);
  for (const double y : {-0.04, 0.04}) {
    add_box(mesh, at(0.88 * width_m, y, 0.5 * height_m), {0.1, 0.03, 0.02}, handle);
  }
  return mesh;
}

Mesh SceneBuilder::bookshelf(const Vector3d& size_m) {
  Mesh mesh;
  const double x = size_m.x(), y = size_m.y(), z = size_m.z(), t = 0.025;
  const int side = wood();
  const int shelves = std::max(2, static_cast<int>(z / 0.38));
  add_box(mesh, at(0, y / 2 - t / 2, z / 2), {x, t, z}, side);
  for (const double s : {-0.5, 0.5}) add_box(mesh, at(s * (x - t), 0, z / 2), {t, y, z}, side);
  for (int k = 0; k <= shelves; ++k) {
    const double height = z * k / shelves;
    add_box(mesh, at(0, 0, height + (k == 0 ? t / 2 : -t / 2)), {x, y, t}, side);
    if (k == shelves) break;
    const double filled = (x - 2 * t) * random.uniform(0.55, 0.95);
    const double tall = (z / shelves - t) * random.uniform(0.65, 0.88);
    add_box(mesh, at(-(x - 2 * t - filled) / 2, 0.02, height + t + tall / 2),
            {filled, 0.7 * y, tall}, books());
  }
  return mesh;
}

Mesh SceneBuilder::framed_poster(double width_m, double height_m) {
  Mesh mesh;
  add_box(mesh, at(0, 0.012, 0), {width_m, 0.024, height_m}, wood());
  add_box(mesh, at(0, 0.02, 0), {width_m - 0.06, 0.016, height_m - 0.06},
          poster(random.uniform(0.25, 0.6)));
  return mesh;
}

Mesh SceneBuilder::monitor(double width_m) {
  Mesh mesh;
  const int shell = metal(), screen = poster(0.35 * width_m);
  const double height = 0.58 * width_m;
  add_box(mesh, at(0, 0, 0.008), {0.4 * width_m, 0.2, 0.016}, shell);
  add_box(mesh, at(0, 0.05, 0.12), {0.08, 0.03, 0.24}, shell);
  add_box(mesh, at(0, 0.02, 0.14 + height / 2), {width_m, 0.04, height}, shell);
  add_box(mesh, at(0, -0.002, 0.14 + height / 2), {width_m - 0.03, 0.01, height - 0.03}, screen);
  return mesh;
}

Mesh SceneBuilder::plant(double height_m) {
  Mesh mesh;
  const double pot = 0.3 * height_m;
  add_cylinder(mesh, {}, 0.16 * height_m, 0.2 * height_m, pot, ceramic());
  add_cylinder(mesh, at(0, 0, pot), 0.02, 0.015, 0.3 * height_m, wood());
  const int leaves = foliage();
  for (int k = 0; k < 5; ++k) {
    const double radius_m = height_m * random.uniform(0.12, 0.2);
    add_leaves(mesh, leaves, radius_m, 0.15 * height_m, height_m * random.uniform(0.55, 0.85));
  }
  return mesh;
}

Mesh SceneBuilder::carton(const Vector3d& size_m) {
  Mesh mesh;
  add_box(mesh, at(0, 0, size_m.z() / 2), size_m, poster(random.uniform(0.15, 0.35)));
  return mesh;
}

Mesh SceneBuilder::small_thing(double s) {
  Mesh mesh;
  switch (random.below(7)) {
    case 0:  // a packet
      add_box(mesh, at(0, 0, 0.6 * s), {0.6 * s, 0.3 * s, 1.2 * s}, poster(0.6 * s));
      break;
    case 1: {  // a pile of books
      double height = 0;
      const int pile = 2 + random.below(3);
      for (int k = 0; k < pile; ++k) {
        const double thick = s * random.uniform(0.1, 0.2);
        const double yaw_deg = random.uniform(-15, 15);
        const Vector3d size{s * random.uniform(0.6, 0.8), s * random.uniform(0.45, 0.6), thick};
        add_box(mesh, at(0, 0, height + thick / 2, yaw_deg), size, poster(0.5 * s));
        height += thick;
      }
      break;
    }
    case 2: {  // a bottle with a label
      const int glass = paint();
      add_cylinder(mesh, {}, 0.2 * s, 0.2 * s, 0.9 * s, glass);
      add_cylinder(mesh, at(0, 0, 0.2 * s), 0.205 * s, 0.205 * s, 0.45 * s, poster(0.4 * s));
      add_cylinder(mesh, at(0, 0, 0.9 * s), 0.2 * s, 0.07 * s, 0.2 * s, glass);
      add_cylinder(mesh, at(0, 0, 1.1 * s), 0.07 * s, 0.07 * s, 0.25 * s, glass);
      break;
    }
    case 3:  // a mug
      add_cylinder(mesh, {}, 0.28 * s, 0.32 * s, 0.6 * s, ceramic());
      add_box(mesh, at(0.38 * s, 0, 0.3 * s), {0.16 * s, 0.06 * s, 0.35 * s}, ceramic());
      break;
    case 4:  // a ball
      add_ellipsoid(mesh, at(0, 0, 0.4 * s), {0.4 * s, 0.4 * s, 0.4 * s}, poster(0.5 * s));
      break;
    case 5:  // a tin
      add_cylinder(mesh, {}, 0.3 * s, 0.3 * s, 0.75 * s, text(0.14 * s));
      add_cylinder(mesh, at(0, 0, 0.75 * s), 0.29 * s, 0.28 * s, 0.04 * s, metal());
      break;
    default:  // a box with a lid
      add_box(mesh, at(0, 0, 0.25 * s), {0.8 * s, 0.55 * s, 0.5 * s}, wood());
      add_box(mesh, at(0, 0, 0.54 * s), {0.84 * s, 0.59 * s, 0.1 * s}, paint());
      break;
  }
  return mesh;
}

Mesh SceneBuilder::tree(double height_m) {
  Mesh mesh;
  const int bark = material(Texture::kConcrete, {0.25f, 0.18f, 0.12f}, {0.1f, 0.07f, 0.05f}, 0.2);
  const int leaves = foliage();
  add_cylinder(mesh, {}, 0.05 * height_m, 0.03 * height_m, 0.6 * height_m, bark);
  for (int k = 0; k < 7; ++k) {
    const double radius_m = height_m * random.uniform(0.13, 0.2);
    add_leaves(mesh, leaves, radius_m, 0.2 * height_m, height_m * random.uniform(0.58, 0.9));
  }
  return mesh;
}

// Along x, 4.3 m, the boot towards +x.
Mesh SceneBuilder::car(int body, bool with_trunk_lid) {
  Mesh mesh;
  const int dark = material(Texture::kFabric, {0.05f, 0.05f, 0.06f}, {0.09f, 0.09f, 0.1f}, 0.1);
  const int glass = material(Texture::kPaint, {0.06f, 0.08f, 0.1f}, {0, 0, 0}, 0.3, 0.8);
  const int plate = text(0.1);
  add_box(mesh, at(-0.1, 0, 0.58), {4.0, 1.75, 0.55}, body);
  add_box(mesh, at(-1.55, 0, 0.88), {1.05, 1.66, 0.1}, body);
  add_box(mesh, at(-0.05, 0, 1.1), {1.9, 1.5, 0.5}, glass);
  add_box(mesh, at(-0.05, 0, 1.38), {1.75, 1.46, 0.08}, body);
  for (const double x : {-0.95, 0.0, 0.9}) {
    for (const double y : {-0.76, 0.76}) {
      add_box(mesh, at(x, y, 1.1), {0.08, 0.05, 0.52}, body);
    }
  }
  add_box(mesh, at(1.95, 0, 0.5), {0.15, 1.7, 0.3}, dark);
  add_box(mesh, at(-2.1, 0, 0.5), {0.12, 1.7, 0.3}, dark);
  add_box(mesh, at(2.03, 0, 0.62), {0.03, 0.52, 0.12}, plate);
  add_box(mesh, at(-2.165, 0, 0.5), {0.03, 0.52, 0.12}, plate);
  const int red = material(Texture::kText, {0.6f, 0.05f, 0.05f}, {0.4f, 0.03f, 0.03f}, 0.05, 0.5);
  const int lamp = material(Texture::kText, {0.7f, 0.7f, 0.65f}, {0.4f, 0.4f, 0.4f}, 0.05, 0.5);
  for (const double y : {-0.68, 0.68}) {
    add_box(mesh, at(1.9, y, 0.75), {0.05, 0.3, 0.14}, red);
    add_box(mesh, at(-2.1, y, 0.75), {0.05, 0.3, 0.14}, lamp);
  }
  add_box(mesh, at(1.25, 0, 0.87), {0.9, 1.5, 0.04}, dark);  // the floor of the boot
  if (with_trunk_lid) add_box(mesh, at(1.36, 0, 0.96), {1.02, 1.62, 0.1}, body);
  const int rim = metal();
  for (const double x : {-1.4, 1.25}) {
    for (const double y : {-0.8, 0.8}) {
      const Rigid3 wheel = at(x, y + 0.1, 0.32) * turned(kX, 90);
      add_cylinder(mesh, wheel, 0.32, 0.32, 0.2, dark);
      add_cylinder(mesh, at(x, y + 0.11, 0.32) * turned(kX, 90), 0.19, 0.19, 0.22, rim);
    }
  }
  return mesh;
}

Mesh SceneBuilder::facade(double width_m, double height_m) {
  Mesh mesh;
  const bool bricks = random.uniform() < 0.6;
  static const Eigen::Vector3f kTones[] = {
      {0.45f, 0.2f, 0.14f}, {0.6f, 0.52f, 0.4f}, {0.5f, 0.46f, 0.42f}};
  const int wall =
      bricks ? material(Texture::kBrick, kTones[random.below(3)], {0.5f, 0.48f, 0.45f}, 0.28)
             : material(Texture::kConcrete, kTones[1 + random.below(2)], {0.3f, 0.28f, 0.25f}, 0.4);
  const int glass =
      material(Texture::kConcrete, {0.12f, 0.15f, 0.18f}, {0.3f, 0.3f, 0.3f}, 0.4, 0.6);
  const int frame = wood();
  add_box(mesh, at(0, -0.15, height_m / 2), {width_m, 0.3, height_m}, wall);
  const int columns = std::max(1, static_cast<int>(width_m / 2.2));
  const int rows = std::max(1, static_cast<int>(height_m / 2.6));
  const int door = random.below(columns);
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const double x = width_m * ((column + 0.5) / columns - 0.5);
      const bool is_door = row == 0 && column == door;
      const double height = is_door ? 2.05 : 1.25;
      const double z = is_door ? 1.025 : 2.6 * row + 1.5;
      add_box(mesh, at(x, 0.02, z), {1.1, 0.06, height}, frame);
      add_box(mesh, at(x, 0.05, z), {0.96, 0.03, height - 0.14}, is_door ? poster(0.8) : glass);
      if (!is_door) {
        add_box(mesh, at(x, 0.06, z), {0.04, 0.05, height - 0.1}, frame);
        add_box(mesh, at(x, 0.12, z - 0.68), {1.2, 0.24, 0.06}, wall);
      }
    }
  }
  if (height_m > 3 && random.uniform() < 0.7) {
    const double x = random.uniform(-0.3, 0.3) * width_m;
    add_box(mesh, at(x, 0.06, 2.55), {0.35 * width_m, 0.12, 0.45}, poster(0.45));
  }
  return mesh;
}

Mesh SceneBuilder::bench() {
  Mesh mesh;
  const int slats = wood(), frame = metal();
  for (int k = 0; k < 4; ++k) {
    add_box(mesh, at(0, -0.2 + 0.13 * k, 0.45), {1.6, 0.1, 0.035}, slats);
    if (k < 3) add_box(mesh, at(0, 0.28, 0.55 + 0.13 * k), {1.6, 0.03, 0.1}, slats);
  }
  for (const double x : {-0.65, 0.65}) {
    add_box(mesh, at(x, -0.15, 0.22), {0.06, 0.06, 0.44}, frame);
    add_box(mesh, at(x, 0.26, 0.44), {0.06, 0.06, 0.88}, frame);
  }
  return mesh;
}

Mesh SceneBuilder::bin() {
  Mesh mesh;
  const int shell = paint();
  add_box(mesh, at(0, 0, 0.5), {0.58, 0.68, 1.0}, shell);
  add_box(mesh, at(0, 0, 1.04), {0.64, 0.74, 0.08}, paint());
  add_box(mesh, at(0, -0.345, 0.65), {0.3, 0.012, 0.3}, poster(0.3));
  return mesh;
}

Mesh SceneBuilder::parasol() {
  Mesh mesh;
  add_cylinder(mesh, {}, 0.3, 0.28, 0.1, metal());
  add_cylinder(mesh, {}, 0.025, 0.025, 2.4, wood());
  add_cylinder(mesh, at(0, 0, 2.1), 1.25, 0.05, 0.4, poster(0.7));
  return mesh;
}

Mesh SceneBuilder::lounger() {
  Mesh mesh;
  const int frame = wood(), cloth = fabric();
  add_legs(mesh, 1.8, 0.6, 0.3, 0.06, frame);
  add_box(mesh, at(-0.3, 0, 0.34), {1.3, 0.62, 0.1}, cloth);
  add_box(mesh, at(0.62, 0, 0.55) * turned(Vector3d::UnitY(), -38), {0.75, 0.62, 0.1}, cloth);
  return mesh;
}

Mesh SceneBuilder::hedge(const Vector3d& size_m) {
  Mesh mesh;
  const int leaves = foliage();
  const int count = std::max(2, static_cast<int>(size_m.x() / 0.6));
  for (int k = 0; k < count; ++k) {
    const double y = random.uniform(-0.1, 0.1);
    const double half_height = size_m.z() * random.uniform(0.5, 0.6);
    add_ellipsoid(mesh, at(size_m.x() * ((k + 0.5) / count - 0.5), y, 0.45 * size_m.z()),
                  {0.55, 0.5 * size_m.y(), half_height}, leaves, 0.1, random.next());
  }
  return mesh;
}

Mesh SceneBuilder::bicycle() {
  Mesh mesh;
  const int frame = paint(), tyre = metal();
  for (const double x : {-0.5, 0.5}) {
    for (int k = 0; k < 20; ++k) {  // a ring of short bars
      const double angle_deg = 18.0 * k;
      const double a = angle_deg * std::numbers::pi / 180;
      add_box(mesh,
              at(x + 0.33 * std::cos(a), 0, 0.34 + 0.33 * std::sin(a)) *
                  turned(Vector3d::UnitY(), -angle_deg),
              {0.04, 0.04, 0.11}, tyre);
    }
  }
  add_box(mesh, at(0.1, 0, 0.6) * turned(Vector3d::UnitY(), -12), {0.75, 0.045, 0.05}, frame);
  add_box(mesh, at(-0.2, 0, 0.55) * turned(Vector3d::UnitY(), 10), {0.05, 0.045, 0.55}, frame);
  add_box(mesh, at(0.15, 0, 0.45) * turned(Vector3d::UnitY(), -45), {0.05, 0.045, 0.6}, frame);
  add_box(mesh, at(-0.3, 0, 0.38), {0.45, 0.045, 0.04}, frame);
  add_box(mesh, at(0.45, 0, 0.7) * turned(Vector3d::UnitY(), -15), {0.05, 0.045, 0.65}, frame);
  add_box(mesh, at(0.42, 0, 1.02), {0.05, 0.55, 0.04}, tyre);
  add_box(mesh, at(-0.24, 0, 0.86), {0.26, 0.14, 0.06}, tyre);
  return mesh;
}

}  // namespace vggtcd
