// SPDX-License-Identifier: Apache-2.0
// The six indoor scenes: two worktops, a hallway, a kitchen, a living room, a desk.
#include "vggtcd/evaluation/synthetic/scenes.h"

namespace vggtcd {
namespace {

using Eigen::Vector3d;

int plaster(SceneBuilder& b) {
  return b.material(Texture::kPlaster, {0.66f, 0.63f, 0.57f}, {0, 0, 0}, 1);
}
int floor_tiles(SceneBuilder& b) {
  return b.material(Texture::kTiles, {0.5f, 0.45f, 0.4f}, {0.3f, 0.28f, 0.26f}, 0.4, 0.1);
}
int splashback(SceneBuilder& b) {
  return b.material(Texture::kTiles, {0.6f, 0.62f, 0.58f}, {0.4f, 0.4f, 0.38f}, 0.11, 0.2);
}

// A machine of boxes and cylinders, about `size_m` high: coffee maker, blender, mixer.
Mesh machine(SceneBuilder& b, double size_m) {
  Mesh mesh;
  const int shell = b.paint(), steel = b.metal(), print = b.text(0.05 * size_m);
  add_box(mesh, at(0, 0, 0.06 * size_m), {0.6 * size_m, 0.75 * size_m, 0.12 * size_m}, shell);
  add_box(mesh, at(0, 0.25 * size_m, 0.45 * size_m), {0.6 * size_m, 0.25 * size_m, 0.8 * size_m},
          shell);
  add_box(mesh, at(0, -0.02 * size_m, 0.88 * size_m), {0.6 * size_m, 0.7 * size_m, 0.24 * size_m},
          shell);
  add_box(mesh, at(0, -0.375 * size_m, 0.88 * size_m), {0.5 * size_m, 0.02 * size_m, 0.17 * size_m},
          print);
  add_cylinder(mesh, at(0, -0.12 * size_m, 0.62 * size_m), 0.07 * size_m, 0.1 * size_m,
               0.15 * size_m, steel);
  add_cylinder(mesh, at(0.18 * size_m, 0.1 * size_m, size_m), 0.12 * size_m, 0.14 * size_m,
               0.22 * size_m, b.ceramic());
  return mesh;
}

// A run of cupboards under a worktop along the wall at y = -depth/2, facing +y.
void kitchen_run(SceneBuilder& b, double y_wall, double width_m) {
  b.fixed("base cupboard", b.cupboard({width_m, 0.6, 0.87}, true), at(0, y_wall + 0.32, 0, 180));
  Mesh top, tiles;
  add_box(top, at(0, y_wall + 0.325, 0.89), {width_m + 0.02, 0.65, 0.04},
          b.material(Texture::kConcrete, {0.5f, 0.47f, 0.43f}, {0.2f, 0.2f, 0.2f}, 0.2, 0.2));
  add_box(tiles, at(0, y_wall + 0.01, 1.18), {width_m, 0.02, 0.54}, splashback(b));
  b.fixed("worktop", std::move(top), {});
  b.fixed("splashback", std::move(tiles), {});
}

}  // namespace

void build_coffee_corner(SceneBuilder& b) {
  const Vector3d room(4.2, 3.6, 2.6);
  const int walls = plaster(b), boards = floor_tiles(b);
  b.room(room, walls, boards);
  kitchen_run(b, -1.8, 2.8);
  b.fixed("wall cupboard", b.cupboard({1.3, 0.34, 0.7}, true), at(-0.75, -1.62, 1.6, 180));
  b.fixed("bookshelf", b.bookshelf({0.7, 0.3, 1.9}), at(-1.92, 0.2, 0, 90));
  b.moved("coffee machine", machine(b, 0.42), at(0.1, -1.45, 0.91, 180),
          at(0.72, -1.43, 0.91, 165));
  b.fixed("kettle", machine(b, 0.27), at(-0.75, -1.45, 0.91, 190));
  b.removed("bread bin", b.carton({0.36, 0.26, 0.22}), at(0.75, -1.5, 0.91, 8));
  b.added("parcel", b.carton({0.3, 0.22, 0.3}), at(-0.35, -1.5, 0.91, -12));
  b.clutter(at(0.42, -1.32, 0.91), {0.3, 0.24}, 0.1, {2, 1, 0, 0});
  b.clutter(at(-1.1, -1.45, 0.91), {0.4, 0.4}, 0.13, {2, 1, 1, 0});
  b.clutter(at(1.15, -1.45, 0.91), {0.4, 0.4}, 0.13, {2, 1, 1, 0});
  b.fixed("plant", b.plant(0.9), at(1.75, -1.3, 0));
  b.lamplight(room);
  arc_walk(b, Epoch::kT1, 40, {{0, -1.5, 1.0}, 1.75, 52, 122, 1.5});
  arc_walk(b, Epoch::kT2, 32, {{0, -1.5, 1.02}, 1.6, 138, 68, 1.45});
  b.scene.scale_t2_from_t1 = 2.2;
}

void build_hallway(SceneBuilder& b) {
  const Vector3d room(2.4, 6.5, 2.6);
  const int walls = plaster(b), boards = b.wood();
  b.room(room, walls, boards);
  // Doors on the long walls; one is opened in T2.
  const int door = b.wood();
  Mesh frame;
  for (const double y : {-1.4, 1.2}) {
    add_box(frame, at(-1.19, y, 1.03), {0.04, 0.96, 2.06}, b.wood());
  }
  b.fixed("door frames", std::move(frame), {});
  b.fixed("door", b.door_panel(0.86, 2.0, door), at(-1.15, -1.83, 0.01, 90));
  b.swung("door", b.door_panel(0.86, 2.0, door), at(-1.15, 0.77, 0.01, 90), Vector3d::UnitZ(), -62);
  b.fixed("coat rack", b.cupboard({1.2, 0.3, 1.9}, false), at(1.03, -1.9, 0, -90));
  b.fixed("bookshelf", b.bookshelf({0.8, 0.28, 1.1}), at(1.05, 0.2, 0, -90));
  b.clutter(at(1.05, 0.2, 1.1, -90), {0.75, 0.26}, 0.14, {2, 1, 1, 0});
  Mesh rug;
  add_box(rug, at(0, 0, 0.006), {1.1, 2.4, 0.012}, b.poster(0.7));
  b.fixed("rug", std::move(rug), at(0, -0.6, 0));
  // A vacuum cleaner that has gone.
  Mesh vacuum;
  const int shell = b.paint(), hose = b.metal();
  add_cylinder(vacuum, {}, 0.18, 0.15, 0.3, shell);
  add_ellipsoid(vacuum, at(0, 0, 0.3), {0.15, 0.15, 0.12}, b.ceramic());
  add_cylinder(vacuum, at(0.1, 0, 0.1) * turned(Vector3d::UnitY(), 18), 0.025, 0.025, 1.1, hose);
  add_box(vacuum, at(0.14, 0, 0.04), {0.2, 0.32, 0.08}, shell);
  b.removed("vacuum cleaner", std::move(vacuum), at(0.55, 1.3, 0, 120));
  b.added("suitcase", b.carton({0.5, 0.28, 0.72}), at(0.75, -0.75, 0, 80));
  b.moved("stool", b.table({0.42, 0.36, 0.46}), at(0.7, 2.2, 0, 5), at(-0.5, 2.35, 0, 30));
  b.clutter(at(0.55, 2.7, 0), {1.0, 0.6}, 0.22, {3, 1, 1, 0});
  b.clutter(at(-0.75, -0.2, 0.0), {0.5, 1.0}, 0.22, {2, 1, 0, 1});
  b.lamplight(room);
  line_walk(b, Epoch::kT1, 50,
            {{0.1, -2.75, 1.5}, {-0.15, -0.1, 1.55}, {0.1, 0.6, 0.9}, {0.2, 3.0, 0.9}});
  line_walk(b, Epoch::kT2, 60,
            {{-0.2, -2.2, 1.6}, {0.1, 0.4, 1.5}, {0.25, 1.0, 0.85}, {0.1, 3.1, 0.9}});
  b.scene.scale_t2_from_t1 = 0.55;
}

void build_kitchen(SceneBuilder& b) {
  const Vector3d room(4.6, 4.2, 2.6);
  const int walls = plaster(b), boards = floor_tiles(b);
  b.room(room, walls, boards);
  kitchen_run(b, -2.1, 3.6);
  b.fixed("wall cupboard", b.cupboard({1.0, 0.34, 0.75}, true), at(-1.1, -1.92, 1.55, 180));
  // An open cupboard and its door.
  b.fixed("wall cupboard", b.cupboard({0.6, 0.34, 0.75}, false), at(0.55, -1.92, 1.55, 180));
  b.swung("cupboard door", b.door_panel(0.58, 0.74, b.paint()), at(0.84, -1.72, 1.555, 180),
          Vector3d::UnitZ(), -105);
  b.fixed("fridge", b.cupboard({0.62, 0.64, 1.75}, true), at(1.95, -0.85, 0, -90));
  b.fixed("table", b.table({1.3, 0.85, 0.74}), at(-0.7, 0.3, 0, 6));
  b.clutter(at(-0.7, 0.3, 0.74, 6), {1.2, 0.75}, 0.17, {3, 2, 2, 1});
  b.fixed("chair", b.chair(), at(-1.65, 0.35, 0, 85));
  b.moved("chair", b.chair(), at(-0.4, -0.45, 0, 178), at(0.75, -0.5, 0, 225));
  b.removed("chair", b.chair(), at(0.25, 0.4, 0, -88));
  b.moved("pot", b.small_thing(0.3), at(0.2, -1.75, 0.91), at(1.2, -1.7, 0.91, 40));
  b.fixed("mixer", machine(b, 0.36), at(-0.75, -1.75, 0.91, 185));
  b.clutter(at(-1.35, -1.75, 0.91), {0.55, 0.45}, 0.16, {3, 1, 1, 0});
  b.clutter(at(0.7, -1.75, 0.91), {0.4, 0.4}, 0.15, {2, 0, 1, 0});
  b.lamplight(room);
  arc_walk(b, Epoch::kT1, 30, {{-0.2, -1.2, 0.95}, 2.7, 58, 118, 1.6});
  arc_walk(b, Epoch::kT2, 30, {{-0.1, -1.2, 0.95}, 2.5, 132, 62, 1.5});
  b.scene.scale_t2_from_t1 = 1.1;
}

void build_living_room(SceneBuilder& b) {
  const Vector3d room(6.0, 5.0, 2.7);
  const int walls = plaster(b), boards = b.wood();
  b.room(room, walls, boards);
  Mesh rug;
  add_box(rug, at(0, 0, 0.008), {2.6, 1.8, 0.016}, b.poster(0.9));
  b.fixed("rug", std::move(rug), at(0, -0.6, 0));
  b.moved("sofa", b.sofa(2.1), at(-0.9, -1.9, 0, 180), at(1.1, -1.85, 0, 172));
  b.removed("armchair", b.sofa(1.0), at(1.6, -1.5, 0, 140));
  b.added("armchair", b.sofa(0.95), at(-2.2, -0.9, 0, 98));
  b.moved("coffee table", b.table({1.1, 0.6, 0.42}), at(-0.6, -0.7, 0, 4), at(0.7, -0.5, 0, 28));
  b.fixed("bookshelf", b.bookshelf({1.4, 0.32, 2.0}), at(-2.8, -1.9, 0, 90));
  b.fixed("bookshelf", b.bookshelf({1.0, 0.3, 1.2}), at(2.8, 0.3, 0, -90));
  b.clutter(at(2.8, 0.3, 1.2, -90), {0.95, 0.28}, 0.2, {2, 1, 1, 0});
  b.fixed("tv bench", b.cupboard({1.6, 0.42, 0.5}, true), at(2.7, -1.25, 0, -90));
  b.removed("tv", b.monitor(1.15), at(2.7, -1.25, 0.5, -90));
  b.added("tv", b.monitor(0.8), at(-1.3, -2.25, 0.0, 180));
  b.fixed("plant", b.plant(1.3), at(2.5, -2.15, 0));
  b.moved("plant", b.plant(1.0), at(-2.6, 0.6, 0), at(-1.9, -2.2, 0));
  b.clutter(at(0, 0.3, 0), {2.6, 1.0}, 0.3, {2, 1, 1, 1});
  b.lamplight(room);
  arc_walk(b, Epoch::kT1, 70, {{0, -1.2, 0.75}, 3.0, 40, 128, 1.6});
  arc_walk(b, Epoch::kT2, 64, {{0.1, -1.2, 0.75}, 2.9, 62, 145, 1.55});
  b.scene.scale_t2_from_t1 = 1.6;
}

void build_desk(SceneBuilder& b) {
  const Vector3d room(3.6, 3.4, 2.5);
  const int walls = plaster(b), boards = b.wood();
  b.room(room, walls, boards);
  b.fixed("desk", b.table({1.6, 0.8, 0.74}), at(0, -1.28, 0));
  b.fixed("monitor", b.monitor(0.6), at(-0.1, -1.45, 0.74, 180));
  b.fixed("bookshelf", b.bookshelf({0.7, 0.28, 1.8}), at(1.4, -1.5, 0, 180));
  b.fixed("papers", b.carton({0.3, 0.22, 0.05}), at(0.45, -1.15, 0.74, 20));
  Mesh laptop, lid;
  const int shell = b.metal();
  add_box(laptop, at(0, 0, 0.009), {0.33, 0.23, 0.018}, shell);
  add_box(laptop, at(0, 0.02, 0.0185), {0.29, 0.1, 0.002}, b.text(0.02));
  add_box(lid, at(0, 0.115, 0.005), {0.33, 0.23, 0.01}, b.poster(0.3));
  b.fixed("laptop", std::move(laptop), at(0.45, -1.4, 0.79, 170));
  b.swung("laptop lid", std::move(lid), at(0.45, -1.4, 0.79, 170) * at(0, -0.115, 0.02),
          Vector3d::UnitX(), 100);
  b.removed("mug", b.small_thing(0.11), at(-0.5, -1.1, 0.74));
  b.added("tin", b.small_thing(0.12), at(0.15, -1.05, 0.74));
  b.moved("book", b.carton({0.2, 0.15, 0.045}), at(-0.3, -1.05, 0.74, 15),
          at(-0.55, -1.3, 0.74, 70));
  b.clutter(at(-0.62, -1.45, 0.74), {0.3, 0.35}, 0.14, {4, 0, 0, 0});
  b.fixed("plant", b.plant(0.5), at(0.68, -1.5, 0.74));
  b.lamplight(room);
  arc_walk(b, Epoch::kT1, 20, {{0, -1.25, 0.85}, 1.35, 60, 118, 1.35});
  arc_walk(b, Epoch::kT2, 24, {{0, -1.25, 0.85}, 1.3, 126, 72, 1.3});
  b.scene.scale_t2_from_t1 = 0.97;
}

void build_worktop(SceneBuilder& b) {
  const Vector3d room(3.8, 3.6, 2.5);
  const int walls = plaster(b), boards = floor_tiles(b);
  b.room(room, walls, boards);
  kitchen_run(b, -1.8, 2.6);
  b.fixed("wall shelf", b.bookshelf({0.9, 0.25, 0.76}), at(-0.7, -1.66, 1.5, 180));
  b.fixed("wall cupboard", b.cupboard({0.9, 0.32, 0.7}, true), at(0.65, -1.62, 1.55, 180));
  b.removed("blender", machine(b, 0.38), at(0.25, -1.45, 0.91, 175));
  b.added("fryer", machine(b, 0.3), at(-0.45, -1.42, 0.91, 188));
  b.fixed("toaster", b.carton({0.3, 0.2, 0.2}), at(0.8, -1.5, 0.91, 5));
  b.moved("chopping board", b.carton({0.36, 0.05, 0.28}), at(-0.15, -1.72, 0.91, 4),
          at(0.45, -1.7, 0.91, -3));
  b.clutter(at(-0.9, -1.45, 0.91), {0.5, 0.45}, 0.14, {3, 1, 1, 1});
  b.clutter(at(1.1, -1.42, 0.91), {0.35, 0.4}, 0.13, {2, 1, 1, 0});
  b.lamplight(room);
  arc_walk(b, Epoch::kT1, 36, {{0, -1.5, 1.0}, 1.7, 60, 128, 1.5});
  arc_walk(b, Epoch::kT2, 36, {{0, -1.5, 1.0}, 1.6, 52, 116, 1.55});
  b.scene.scale_t2_from_t1 = 1.0;
}

}  // namespace vggtcd
