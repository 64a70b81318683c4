// SPDX-License-Identifier: Apache-2.0
// The five outdoor scenes: a car that is unloaded, a courtyard, a barbecue, a pool, a street.
#include <cmath>

#include "vggtcd/evaluation/synthetic/scenes.h"

namespace vggtcd {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Uneven ground of the given material in a rectangle.
void ground(SceneBuilder& b, const std::string& name, const Vector2d& low, const Vector2d& high,
            double level, double waves, int material) {
  Mesh mesh;
  const double phase = b.random.uniform(0, 6);
  add_heightfield(mesh, low, high, 0.5, material, [=](double x, double y) {
    return level + waves * (std::sin(0.9 * x + phase) * std::cos(0.7 * y) +
                            0.5 * std::sin(2.1 * y + 1.3 * x));
  });
  b.fixed(name, std::move(mesh), {});
}

int grass(SceneBuilder& b) {
  return b.material(Texture::kGrass, {0.22f, 0.33f, 0.10f}, {0.32f, 0.28f, 0.13f}, 0.1);
}
int asphalt(SceneBuilder& b) {
  return b.material(Texture::kConcrete, {0.27f, 0.27f, 0.28f}, {0.12f, 0.12f, 0.12f}, 0.3);
}
int paving(SceneBuilder& b) {
  return b.material(Texture::kTiles, {0.45f, 0.42f, 0.38f}, {0.25f, 0.23f, 0.2f}, 0.6);
}

void far_trees(SceneBuilder& b, double radius, int count, double from_deg, double to_deg) {
  for (int k = 0; k < count; ++k) {
    const double angle = (from_deg + (to_deg - from_deg) * (k + 0.5) / count) * 0.017453292519943;
    const double r = radius * b.random.uniform(0.9, 1.25);
    b.fixed("tree", b.tree(b.random.uniform(4, 7)),
            at(r * std::cos(angle), r * std::sin(angle), -0.05));
  }
}

}  // namespace

void build_driveway(SceneBuilder& b) {
  ground(b, "lawn", {-30, -30}, {30, 30}, -0.12, 0.06, grass(b));
  ground(b, "driveway", {-7, -4.5}, {8, 3.6}, 0, 0.004, asphalt(b));
  b.fixed("house", b.facade(13, 5.6), at(0, -5.4, -0.1));
  b.fixed("fence", b.facade(9, 2.1), at(-9.5, 2, -0.1, -80));
  b.fixed("hedge", b.hedge({9, 1.1, 1.3}), at(3, 6.5, 0));
  b.fixed("hedge", b.hedge({5, 1.0, 1.1}), at(9.5, 0, 0, 90));
  far_trees(b, 17, 7, 10, 170);
  const int body = b.paint();
  b.fixed("car", b.car(body, false), at(0, 0, 0, 4));
  // The boot lid, hinged at its front edge, opened in T2.
  Mesh lid;
  add_box(lid, at(0.51, 0, 0), {1.02, 1.62, 0.1}, body);
  b.swung("boot lid", std::move(lid), at(0, 0, 0, 4) * at(0.85, 0, 0.96), Vector3d::UnitY(), -72);
  b.added("carton", b.carton({0.6, 0.45, 0.5}), at(2.9, 0.9, 0.01, 20));
  b.added("carton", b.carton({0.45, 0.4, 0.35}), at(2.8, -0.5, 0.01, -12));
  b.added("suitcase", b.carton({0.5, 0.25, 0.75}), at(1.9, 1.7, 0.01, 35));
  b.removed("bicycle", b.bicycle(), at(-0.5, -3.3, 0.0, 5));
  b.moved("bin", b.bin(), at(3.6, -2.9, 0, 170), at(-3.4, -2.8, 0, 190));
  b.fixed("bin", b.bin(), at(-5.4, -3.3, 0, 182));
  b.fixed("planter", b.plant(1.2), at(-3.3, 2.6, 0));
  b.removed("planter", b.plant(1.1), at(-2.3, 2.8, 0));
  b.clutter(at(0.5, 2.4, 0.0), {4.2, 0.9}, 0.28, {3, 1, 1, 1});
  b.daylight();
  arc_walk(b, Epoch::kT1, 84, {{0.5, -0.3, 0.7}, 5.4, -28, 138, 1.6});
  arc_walk(b, Epoch::kT2, 84, {{0.7, -0.2, 0.7}, 5.0, 162, -12, 1.75});
  b.scene.scale_t2_from_t1 = 0.45;
}

void build_courtyard(SceneBuilder& b) {
  ground(b, "ground", {-16, -14}, {16, 14}, -0.03, 0.012, paving(b));
  ground(b, "flower bed", {-3, -2.4}, {3, 2.4}, 0.02, 0.05, grass(b));
  b.fixed("house", b.facade(18, 8.2), at(0, -9, -0.1));
  b.fixed("house", b.facade(17, 7.6), at(-10, 0, -0.1, -90));
  b.fixed("house", b.facade(17, 6.0), at(10.5, 0, -0.1, 90));
  b.fixed("house", b.facade(21, 5.5), at(0, 9.5, -0.1, 180));
  b.fixed("tree", b.tree(5.2), at(0.4, 0.3, 0));
  b.fixed("planter", b.plant(1.5), at(-2.2, 1.4, 0));
  b.fixed("bench", b.bench(), at(-5.5, -3.2, 0, 60));
  b.moved("bench", b.bench(), at(1.5, -4.3, 0, 180), at(4.6, -3.4, 0, 118));
  b.removed("parasol", b.parasol(), at(-4.2, 3.0, 0));
  b.removed("table", b.table({1.3, 0.8, 0.74}), at(-4.0, 3.9, 0, 15));
  b.added("crate", b.carton({0.9, 0.9, 0.8}), at(4.6, 1.6, 0, 25));
  b.added("crate", b.carton({0.8, 0.8, 0.7}), at(4.7, 1.7, 0.8, 8));
  b.added("crate", b.carton({0.9, 0.7, 0.6}), at(5.6, 0.8, 0, -15));
  b.moved("planter", b.plant(1.3), at(2.7, 1.6, 0), at(5.9, -1.8, 0));
  b.fixed("bin", b.bin(), at(-7.9, -5.4, 0, -70));
  b.fixed("bicycle", b.bicycle(), at(-6.6, -6.6, 0, 20));
  b.removed("bicycle", b.bicycle(), at(-4.9, -7.0, 0, -5));
  b.clutter(at(-1.5, -4.4, 0), {3.0, 1.6}, 0.35, {3, 1, 1, 1});
  b.daylight();
  arc_walk(b, Epoch::kT1, 60, {{0.3, -0.4, 0.9}, 6.6, 20, 205, 1.65});
  arc_walk(b, Epoch::kT2, 48, {{0.2, -0.6, 0.9}, 7.0, 75, 262, 1.7});
  b.scene.scale_t2_from_t1 = 1.9;
}

void build_barbecue(SceneBuilder& b) {
  ground(b, "lawn", {-20, -20}, {20, 20}, -0.1, 0.05, grass(b));
  ground(b, "patio", {-3.6, -3.0}, {3.6, 3.0}, 0, 0.003, paving(b));
  b.fixed("wall", b.facade(8, 3.0), at(0, -3.2, -0.1));
  b.fixed("fence", b.facade(7, 2.2), at(-4.6, 0.5, -0.1, -90));
  b.fixed("hedge", b.hedge({7, 1.0, 1.5}), at(1, 5.5, 0));
  far_trees(b, 11, 5, 20, 130);
  // The grill: a cabinet, a bowl and a lid that opens.
  Mesh grill;
  const int steel = b.metal(), black = b.paint();
  add_box(grill, at(0, 0, 0.42), {1.1, 0.55, 0.84}, steel);
  add_box(grill, at(0, 0.29, 0.45), {0.5, 0.02, 0.6}, b.poster(0.4));
  add_box(grill, at(0, 0, 0.9), {0.8, 0.56, 0.12}, black);
  for (const double x : {-0.78, 0.78}) add_box(grill, at(x, 0, 0.88), {0.44, 0.5, 0.03}, b.wood());
  b.fixed("grill", std::move(grill), at(-0.6, -1.7, 0, 5));
  Mesh lid;
  add_box(lid, at(0, 0.28, 0.14), {0.8, 0.56, 0.28}, black);
  add_box(lid, at(0, 0.58, 0.12), {0.4, 0.04, 0.04}, steel);
  b.swung("grill lid", std::move(lid), at(-0.6, -1.7, 0, 5) * at(0, -0.28, 0.965),
          Vector3d::UnitX(), 78);
  b.fixed("table", b.table({1.5, 0.9, 0.74}), at(0.9, 0.6, 0, 12));
  b.clutter(at(0.9, 0.6, 0.74, 12), {1.4, 0.8}, 0.22, {3, 1, 2, 1});
  b.moved("chair", b.chair(), at(0.8, 1.45, 0, 10), at(-1.3, 1.1, 0, 60));
  b.fixed("chair", b.chair(), at(1.95, 0.7, 0, -80));
  b.removed("chair", b.chair(), at(0.9, -0.3, 0, 185));
  b.added("gas bottle", b.small_thing(0.6), at(-1.8, -1.6, 0));
  b.fixed("planter", b.plant(1.3), at(2.6, -2.0, 0));
  b.added("planter", b.plant(1.0), at(1.7, -2.2, 0));
  b.clutter(at(-2.4, 0.4, 0), {1.2, 1.8}, 0.3, {3, 1, 0, 1});
  b.daylight();
  arc_walk(b, Epoch::kT1, 40, {{0.0, -0.6, 0.6}, 3.5, 12, 128, 1.6});
  arc_walk(b, Epoch::kT2, 36, {{0.1, -0.5, 0.6}, 3.7, 40, 150, 1.5});
  b.scene.scale_t2_from_t1 = 1.3;
}

void build_poolside(SceneBuilder& b) {
  // The lawn dips under the terrace and the pool.
  Mesh lawn;
  add_heightfield(lawn, {-25, -25}, {25, 25}, 0.5, grass(b), [](double x, double y) {
    const bool under = std::abs(x) < 5.6 && y > -4.3 && y < 3.3;
    return under ? -1.5 : -0.4 + 0.05 * std::sin(0.9 * x) * std::cos(0.7 * y);
  });
  b.fixed("lawn", std::move(lawn), {});
  // A terrace around a pool of 5 x 3 m, 1.1 m deep, empty of water.
  Mesh terrace, pool;
  const int stone = paving(b);
  const int tile =
      b.material(Texture::kTiles, {0.25f, 0.45f, 0.55f}, {0.6f, 0.62f, 0.6f}, 0.15, 0.2);
  add_box(terrace, at(0, 2.6, -0.25), {12, 2.2, 0.5}, stone);
  add_box(terrace, at(0, -3.1, -0.25), {12, 3.2, 0.5}, stone);
  add_box(terrace, at(-4.25, 0, -0.25), {3.5, 3.0, 0.5}, stone);
  add_box(terrace, at(4.25, 0, -0.25), {3.5, 3.0, 0.5}, stone);
  add_box(pool, at(0, 0, -1.15), {5.0, 3.0, 0.1}, tile);
  for (const double s : {-1.0, 1.0}) {
    add_box(pool, at(s * 2.475, 0, -0.6), {0.05, 3.0, 1.15}, tile);
    add_box(pool, at(0, s * 1.475, -0.6), {5.0, 0.05, 1.15}, tile);
  }
  b.fixed("terrace", std::move(terrace), {});
  b.fixed("pool", std::move(pool), {});
  b.fixed("house", b.facade(13, 5.5), at(0, -4.8, -0.4));
  b.fixed("fence", b.facade(8, 2.0), at(-6.3, 0, -0.4, -90));
  b.fixed("hedge", b.hedge({8, 1.2, 1.6}), at(6.8, 0, -0.4, 90));
  far_trees(b, 14, 6, 20, 150);
  // A cover over half the pool in T2, the largest change of all scenes.
  Mesh cover;
  add_box(cover, at(0, 0, 0.06), {2.3, 3.2, 0.12}, b.poster(0.9));
  b.added("pool cover", std::move(cover), at(-1.2, 0, 0.0));
  b.moved("lounger", b.lounger(), at(3.2, -2.5, 0, 80), at(0.6, -2.4, 0, 100));
  b.removed("lounger", b.lounger(), at(4.5, -2.4, 0, 85));
  b.removed("parasol", b.parasol(), at(3.9, -3.4, 0));
  b.fixed("table", b.table({0.8, 0.8, 0.7}), at(-3.4, -2.6, 0));
  b.fixed("chair", b.chair(), at(-3.4, -1.8, 0, 15));
  b.moved("chair", b.chair(), at(-4.4, -2.6, 0, 95), at(-2.0, -3.2, 0, -120));
  b.added("carton", b.carton({0.9, 0.6, 0.7}), at(4.7, -1.9, 0, 15));
  b.clutter(at(-3.4, -2.6, 0.7), {0.75, 0.75}, 0.2, {2, 1, 1, 0});
  b.clutter(at(-4.2, 0.4, 0), {1.6, 2.4}, 0.35, {3, 1, 1, 1});
  b.daylight();
  arc_walk(b, Epoch::kT1, 50, {{0, -0.9, 0.1}, 5.3, 18, 152, 1.9});
  arc_walk(b, Epoch::kT2, 50, {{0, -0.9, 0.1}, 5.0, 172, 48, 2.0});
  b.scene.scale_t2_from_t1 = 0.7;
}

void build_street(SceneBuilder& b) {
  ground(b, "road", {-24, -3.4}, {30, 3.4}, 0, 0.008, asphalt(b));
  const int slabs = paving(b);
  for (const double side : {-1.0, 1.0}) {
    Mesh pavement;
    add_box(pavement, at(3, side * 4.6, 0), {54, 2.4, 0.24}, slabs);
    b.fixed("pavement", std::move(pavement), {});
    double x = -22;
    while (x < 28) {
      const double width = b.random.uniform(5.5, 9);
      const double height = b.random.uniform(5.3, 8.5);
      const double back = b.random.uniform(0, 0.5);
      b.fixed("house", b.facade(width, height),
              at(x + width / 2, side * (6.0 + back), 0, side < 0 ? 0 : 180));
      x += width + b.random.uniform(0, 0.6);
    }
  }
  b.fixed("house", b.facade(16, 9), at(31, 0, 0, 90));
  b.fixed("house", b.facade(16, 8), at(-25, 0, 0, -90));
  b.fixed("tree", b.tree(5.0), at(-1, 4.4, 0));
  b.fixed("tree", b.tree(4.6), at(13, 4.5, 0));
  b.fixed("car", b.car(b.paint(), true), at(-5.5, -2.4, 0, 2));
  b.removed("car", b.car(b.paint(), true), at(2.0, -2.4, 0, -1));
  b.fixed("car", b.car(b.paint(), true), at(9.0, -2.4, 0, 181));
  b.added("car", b.car(b.paint(), true), at(15.5, -2.35, 0, 1));
  b.removed("car", b.car(b.paint(), true), at(7.5, 2.4, 0, 180));
  b.moved("car", b.car(b.paint(), true), at(-3.5, 2.4, 0, 182), at(0.8, 2.3, 0, 178));
  b.fixed("bin", b.bin(), at(-1.5, -4.6, 0.12, 4));
  b.moved("bin", b.bin(), at(4.9, -4.7, 0.12, 10), at(6.6, -4.5, 0.12, -20));
  b.added("skip", b.carton({2.4, 1.4, 1.1}), at(12.0, 2.3, 0, 3));
  b.fixed("bench", b.bench(), at(4.5, 5.2, 0.12));
  b.removed("bicycle", b.bicycle(), at(11.4, -5.2, 0.12));
  b.added("planter", b.plant(1.3), at(8.2, 4.8, 0.12));
  b.clutter(at(3, -4.6, 0.12), {18, 1.2}, 0.5, {5, 1, 2, 1});
  b.clutter(at(3, 4.5, 0.12), {16, 1.2}, 0.5, {4, 1, 1, 1});
  b.daylight();
  line_walk(b, Epoch::kT1, 100,
            {{-11, -0.5, 1.6}, {9, 0.4, 1.65}, {0, -3.2, 1.4}, {20, -1.2, 1.4}});
  line_walk(b, Epoch::kT2, 80, {{-6, 0.6, 1.7}, {13, -0.3, 1.6}, {4, -3.6, 1.4}, {25, -1.5, 1.5}});
  b.scene.scale_t2_from_t1 = 2.5;
}

}  // namespace vggtcd
