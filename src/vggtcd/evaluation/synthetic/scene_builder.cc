// SPDX-License-Identifier: Apache-2.0
// Materials, placement, clutter, rooms and light; furniture is in furniture.cc.
#include "vggtcd/evaluation/synthetic/scene_builder.h"

#include <algorithm>
#include <cmath>

namespace vggtcd {
namespace {

uint64_t name_key(std::string_view name) {
  uint64_t key = 0;
  for (const char c : name) key = mix64(key, static_cast<unsigned char>(c));
  return key;
}

}  // namespace

SceneBuilder::SceneBuilder(std::string_view name, uint64_t seed) : random(seed, {name_key(name)}) {
  scene.name = name;
  scene.seed = seed;
  scene.key = mix64(name_key(name), seed);
}

Eigen::Vector3f SceneBuilder::varied(const Eigen::Vector3f& color) {
  Eigen::Vector3f result;
  const double light = random.uniform(0.85, 1.15);
  for (int k = 0; k < 3; ++k) {
    result[k] = static_cast<float>(color[k] * light * random.uniform(0.92, 1.08));
  }
  return result;
}

int SceneBuilder::material(Texture texture, const Eigen::Vector3f& color,
                           const Eigen::Vector3f& second, double feature_m, double gloss) {
  Material m;
  m.texture = texture;
  m.color = varied(color);
  m.second_color = varied(second);
  m.feature_m = static_cast<float>(feature_m);
  m.gloss = static_cast<float>(gloss);
  m.seed = random.next();
  scene.materials.push_back(m);
  return static_cast<int>(scene.materials.size()) - 1;
}

int SceneBuilder::wood() {
  static const Eigen::Vector3f kTones[] = {
      {0.55f, 0.36f, 0.20f}, {0.34f, 0.20f, 0.11f}, {0.66f, 0.52f, 0.36f}};
  const Eigen::Vector3f& tone = kTones[random.below(3)];
  return material(Texture::kPlanks, tone, 0.45f * tone, random.uniform(0.09, 0.2), 0.05);
}
int SceneBuilder::metal() {
  return material(Texture::kMetal, {0.45f, 0.46f, 0.48f}, {0.2f, 0.2f, 0.2f}, 0.2, 0.5);
}
int SceneBuilder::paint() {
  static const Eigen::Vector3f kTones[] = {{0.55f, 0.08f, 0.07f}, {0.08f, 0.16f, 0.45f},
                                           {0.6f, 0.6f, 0.58f},   {0.10f, 0.35f, 0.18f},
                                           {0.65f, 0.5f, 0.1f},   {0.12f, 0.12f, 0.13f}};
  return material(Texture::kPaint, kTones[random.below(6)], {0.1f, 0.1f, 0.1f}, 0.3, 0.4);
}
int SceneBuilder::fabric() {
  static const Eigen::Vector3f kTones[] = {
      {0.35f, 0.25f, 0.2f}, {0.2f, 0.3f, 0.4f}, {0.45f, 0.42f, 0.36f}, {0.4f, 0.15f, 0.15f}};
  const Eigen::Vector3f& tone = kTones[random.below(4)];
  return material(Texture::kFabric, tone, 0.5f * tone + Eigen::Vector3f(0.1f, 0.12f, 0.08f),
                  random.uniform(0.08, 0.25));
}
int SceneBuilder::poster(double page_m) {
  return material(Texture::kPoster, {0.6f, 0.58f, 0.52f}, {0.1f, 0.1f, 0.1f}, page_m);
}
int SceneBuilder::books() {
  return material(Texture::kBooks, {0.5f, 0.4f, 0.3f}, {0.1f, 0.1f, 0.1f}, 0.09);
}
int SceneBuilder::text(double line_m) {
  return material(Texture::kText, {0.75f, 0.73f, 0.68f}, {0.07f, 0.07f, 0.09f}, line_m);
}
int SceneBuilder::foliage() {
  return material(Texture::kFoliage, {0.20f, 0.34f, 0.10f}, {0.06f, 0.13f, 0.04f}, 0.09);
}
int SceneBuilder::ceramic() {
  static const Eigen::Vector3f kTones[] = {
      {0.75f, 0.74f, 0.7f}, {0.2f, 0.35f, 0.5f}, {0.7f, 0.35f, 0.15f}, {0.5f, 0.55f, 0.25f}};
  return material(Texture::kFabric, kTones[random.below(4)], {0.5f, 0.3f, 0.2f}, 0.05, 0.3);
}

void SceneBuilder::fixed(std::string name, Mesh mesh, const Rigid3& pose) {
  scene.objects.push_back({std::move(name), std::move(mesh), {pose, pose}});
}
void SceneBuilder::removed(std::string name, Mesh mesh, const Rigid3& pose_t1) {
  scene.objects.push_back({std::move(name), std::move(mesh), {pose_t1, std::nullopt}});
}
void SceneBuilder::added(std::string name, Mesh mesh, const Rigid3& pose_t2) {
  scene.objects.push_back({std::move(name), std::move(mesh), {std::nullopt, pose_t2}});
}
void SceneBuilder::moved(std::string name, Mesh mesh, const Rigid3& pose_t1,
                         const Rigid3& pose_t2) {
  scene.objects.push_back({std::move(name), std::move(mesh), {pose_t1, pose_t2}});
}
void SceneBuilder::swung(std::string name, Mesh mesh, const Rigid3& pose_t1,
                         const Eigen::Vector3d& axis, double angle_deg) {
  moved(std::move(name), std::move(mesh), pose_t1, pose_t1 * turned(axis, angle_deg));
}

void SceneBuilder::clutter(const Rigid3& pose, const Eigen::Vector2d& extent_m, double size_m,
                           const ClutterChanges& changes) {
  struct Disc {
    Eigen::Vector2d centre;
    double radius;
  };
  std::vector<Disc> taken;  // in either epoch: what is added never stands where something was
  const auto place = [&](double radius) -> std::optional<Rigid3> {
    for (int attempt = 0; attempt < 60; ++attempt) {
      const Eigen::Vector2d centre{
          random.uniform(-0.5, 0.5) * std::max(0.0, extent_m.x() - 2 * radius),
          random.uniform(-0.5, 0.5) * std::max(0.0, extent_m.y() - 2 * radius)};
      const bool free = std::none_of(taken.begin(), taken.end(), [&](const Disc& disc) {
        return (disc.centre - centre).norm() < disc.radius + radius;
      });
      if (!free) continue;
      taken.push_back({centre, radius});
      return pose * at(centre.x(), centre.y(), 0, random.uniform(0, 360));
    }
    return std::nullopt;  // the shelf is full
  };
  const int total = changes.unchanged + changes.removed + changes.added + changes.moved;
  for (int k = 0; k < total; ++k) {
    const double size = size_m * random.uniform(0.6, 1.5);
    Mesh mesh = small_thing(size);
    const auto first = place(0.5 * size);
    if (!first) continue;
    if (k < changes.removed) {
      removed("thing", std::move(mesh), *first);
    } else if (k < changes.removed + changes.added) {
      added("thing", std::move(mesh), *first);
    } else if (k < changes.removed + changes.added + changes.moved) {
      const auto second = place(0.5 * size);
      if (second) moved("thing", std::move(mesh), *first, *second);
    } else {
      fixed("thing", std::move(mesh), *first);
    }
  }
}

void SceneBuilder::room(const Eigen::Vector3d& size_m, int wall_material, int floor_material) {
  const double x = size_m.x(), y = size_m.y(), z = size_m.z(), t = 0.1;
  Mesh floor, ceiling, walls, skirting;
  add_box(floor, at(0, 0, -t / 2), {x + t, y + t, t}, floor_material);
  const int white = material(Texture::kPlaster, {0.75f, 0.74f, 0.72f}, {0, 0, 0}, 1);
  add_box(ceiling, at(0, 0, z + t / 2), {x + t, y + t, t}, white);
  const int board = wood();
  for (const double side : {-1.0, 1.0}) {
    add_box(walls, at(side * (x + t) / 2, 0, z / 2), {t, y + 2 * t, z}, wall_material);
    add_box(walls, at(0, side * (y + t) / 2, z / 2), {x + 2 * t, t, z}, wall_material);
    add_box(skirting, at(side * (x / 2 - 0.008), 0, 0.05), {0.016, y, 0.1}, board);
    add_box(skirting, at(0, side * (y / 2 - 0.008), 0.05), {x, 0.016, 0.1}, board);
  }
  fixed("floor", std::move(floor), {});
  fixed("ceiling", std::move(ceiling), {});
  fixed("walls", std::move(walls), {});
  fixed("skirting", std::move(skirting), {});
  // Pictures, a few per wall.
  for (int side = 0; side < 4; ++side) {
    const double along = side % 2 == 0 ? x : y;
    const double depth = side % 2 == 0 ? y : x;
    const int count = std::max(1, static_cast<int>(along / 1.6));
    for (int k = 0; k < count; ++k) {
      const double width = random.uniform(0.4, 0.9), height = random.uniform(0.4, 0.8);
      const double u = along * ((k + 0.5) / count - 0.5) + random.uniform(-0.15, 0.15);
      Rigid3 pose = turned(Eigen::Vector3d::UnitZ(), 180 + 90.0 * side);
      pose.translation = pose.rotation * Eigen::Vector3d(u, -depth / 2, 0) +
                         Eigen::Vector3d(0, 0, z * random.uniform(0.45, 0.55));
      fixed("picture", framed_poster(width, height), pose);
    }
  }
}

void SceneBuilder::daylight() {
  const double azimuth = random.uniform(0, 6.28);
  for (Lighting& light : scene.lighting) {
    const double turn = azimuth + random.uniform(-0.5, 0.5);  // an hour or two apart
    light.to_sun =
        Eigen::Vector3d(std::cos(turn), std::sin(turn), random.uniform(0.9, 1.5)).normalized();
    light.sun = Eigen::Vector3f(1.5f, 1.4f, 1.25f) * static_cast<float>(random.uniform(0.75, 1.1));
    light.ambient = {0.62f, 0.66f, 0.74f};
    light.exposure = static_cast<float>(random.uniform(0.85, 1.15));
    light.white_balance = {static_cast<float>(random.uniform(0.95, 1.05)), 1.0f,
                           static_cast<float>(random.uniform(0.94, 1.06))};
  }
}

void SceneBuilder::lamplight(const Eigen::Vector3d& room_m) {
  const double x = random.uniform(-0.2, 0.2) * room_m.x();
  const double y = random.uniform(-0.2, 0.2) * room_m.y();
  const float power = static_cast<float>(0.24 * room_m.z() * room_m.z());
  for (Lighting& light : scene.lighting) {
    const float dim = static_cast<float>(random.uniform(0.85, 1.15));
    light.ambient = Eigen::Vector3f(0.62f, 0.60f, 0.57f) * dim;
    light.lamps = {{{x - 0.22 * room_m.x(), y, 0.94 * room_m.z()},
                    Eigen::Vector3f(1.0f, 0.93f, 0.82f) * power * dim},
                   {{x + 0.25 * room_m.x(), -y, 0.94 * room_m.z()},
                    Eigen::Vector3f(0.95f, 0.95f, 0.95f) * power * 0.8f}};
    light.exposure = static_cast<float>(random.uniform(0.85, 1.15));
    light.white_balance = {static_cast<float>(random.uniform(0.95, 1.06)), 1.0f,
                           static_cast<float>(random.uniform(0.92, 1.05))};
  }
}

}  // namespace vggtcd
