// SPDX-License-Identifier: Apache-2.0
// Scenes by name, and the cameras that walk through them.
#include "vggtcd/evaluation/synthetic/scene.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "vggtcd/core/error.h"
#include "vggtcd/evaluation/synthetic/scenes.h"

namespace vggtcd {
namespace {

using Eigen::Vector3d;

constexpr double kRadPerDeg = std::numbers::pi / 180.0;

struct NamedScene {
  std::string_view name;
  bool outdoor;
  void (*build)(SceneBuilder&);
};

constexpr NamedScene kScenes[] = {
    {"driveway", true, build_driveway},
    {"courtyard", true, build_courtyard},
    {"barbecue", true, build_barbecue},
    {"poolside", true, build_poolside},
    {"street", true, build_street},
    {"coffee_corner", false, build_coffee_corner},
    {"hallway", false, build_hallway},
    {"kitchen", false, build_kitchen},
    {"living_room", false, build_living_room},
    {"desk", false, build_desk},
    {"worktop", false, build_worktop},
    {"moving_day", false, build_moving_day},  // beside the eleven
};
constexpr size_t kNumScenes = 11;

void take_changes_back(std::vector<SceneObject>& objects) {
  std::erase_if(objects, [](const SceneObject& object) { return !object.world_from_object[0]; });
  for (SceneObject& object : objects) object.world_from_object[1] = object.world_from_object[0];
}

// Catmull-Rom through the knots, 0 <= t <= 1.
Vector3d spline(const std::vector<Vector3d>& knots, double t) {
  const int segments = static_cast<int>(knots.size()) - 1;
  const double along = std::clamp(t, 0.0, 1.0) * segments;
  const int k = std::min(static_cast<int>(along), segments - 1);
  const double u = along - k;
  const auto knot = [&](int index) {
    return knots[static_cast<size_t>(std::clamp(index, 0, segments))];
  };
  const Vector3d a = knot(k - 1), b = knot(k), c = knot(k + 1), d = knot(k + 2);
  return 0.5 * (2 * b + u * (c - a) + u * u * (2 * a - 5 * b + 4 * c - d) +
                u * u * u * (3 * b - a - 3 * c + d));
}

// Colours stay with kNone; with kOne everything is chequered, as far as the photos tell.
void apply_texture(SceneTexture texture, std::vector<Material>& materials) {
  if (texture == SceneTexture::kScene) return;
  for (Material& material : materials) {
    if (texture == SceneTexture::kOne) {
      material = {.texture = Texture::kChequer,
                  .color = {0.55f, 0.3f, 0.22f},
                  .second_color = {0.7f, 0.68f, 0.62f},
                  .feature_m = 0.15f};
    } else {
      material.texture = Texture::kChequer;  // in one colour
      material.second_color = material.color;
      material.gloss = 0;
    }
  }
}

// OpenCV axes (x right, y down, z forward) for an upright camera.
Rigid3 look_at(const Vector3d& eye, const Vector3d& target) {
  const Vector3d z = (target - eye).normalized();
  const Vector3d x = z.cross(Vector3d::UnitZ()).normalized();
  const Vector3d y = z.cross(x);
  Rigid3 camera_from_world;
  camera_from_world.rotation << x.transpose(), y.transpose(), z.transpose();
  camera_from_world.translation = -(camera_from_world.rotation * eye);
  return camera_from_world;
}

}  // namespace

std::span<const EnumName<ObjectChange>> enum_names(ObjectChange) {
  static constexpr EnumName<ObjectChange> kNames[] = {{ObjectChange::kUnchanged, "unchanged"},
                                                      {ObjectChange::kAdded, "added"},
                                                      {ObjectChange::kRemoved, "removed"},
                                                      {ObjectChange::kMoved, "moved"}};
  return kNames;
}

ObjectChange SceneObject::change() const {
  const auto& [t1, t2] = world_from_object;
  if (!t1) return ObjectChange::kAdded;
  if (!t2) return ObjectChange::kRemoved;
  const bool same = t1->rotation == t2->rotation && t1->translation == t2->translation;
  return same ? ObjectChange::kUnchanged : ObjectChange::kMoved;
}

std::span<const EnumName<SceneTexture>> enum_names(SceneTexture) {
  static constexpr EnumName<SceneTexture> kNames[] = {
      {SceneTexture::kScene, "scene"}, {SceneTexture::kOne, "one"}, {SceneTexture::kNone, "none"}};
  return kNames;
}

std::span<const EnumName<SceneChange>> enum_names(SceneChange) {
  static constexpr EnumName<SceneChange> kNames[] = {{SceneChange::kScene, "scene"},
                                                     {SceneChange::kNone, "none"}};
  return kNames;
}

Eigen::AlignedBox3d SceneObject::box_m() const {
  Eigen::AlignedBox3d box;
  for (const Mesh::Vertex& vertex : mesh.vertices) box.extend(vertex.position_m.cast<double>());
  return box;
}

std::span<const std::string_view> all_scene_names() {
  static const std::vector<std::string_view> names = [] {
    std::vector<std::string_view> list;
    for (const NamedScene& scene : kScenes) list.push_back(scene.name);
    return list;
  }();
  return names;
}

std::span<const std::string_view> scene_names() { return all_scene_names().first(kNumScenes); }

SyntheticScene make_scene(std::string_view name, uint64_t seed, SceneChange change,
                          SceneTexture texture) {
  for (const NamedScene& entry : kScenes) {
    if (entry.name != name) continue;
    SceneBuilder builder(name, seed);
    builder.scene.outdoor = entry.outdoor;
    entry.build(builder);
    if (change == SceneChange::kNone) take_changes_back(builder.scene.objects);
    apply_texture(texture, builder.scene.materials);
    return std::move(builder.scene);
  }
  std::string known;
  for (const std::string_view each : all_scene_names())
    known += (known.empty() ? "" : ", ") + std::string(each);
  throw_error(ErrorCode::kUsage, "scene: expected one of {}, found '{}'", known, name);
}

namespace {

CameraPath arc_path(Random& random, const WalkPlan& plan) {
  constexpr int kKnots = 7;
  CameraPath path;
  for (int k = 0; k < kKnots; ++k) {
    const double angle =
        (plan.from_deg + (plan.to_deg - plan.from_deg) * k / (kKnots - 1)) * kRadPerDeg;
    const double radius = plan.radius_m * random.uniform(0.92, 1.08);
    const double height = plan.height_m * random.uniform(0.93, 1.07);
    path.eye_m.emplace_back(plan.centre_m.x() + radius * std::cos(angle),
                            plan.centre_m.y() + radius * std::sin(angle), height);
    const double wander = 0.09 * plan.radius_m;
    const double dx = random.uniform(-wander, wander), dy = random.uniform(-wander, wander);
    const double dz = random.uniform(-0.3, 0.3) * wander;
    path.target_m.push_back(plan.centre_m + Vector3d(dx, dy, dz));
  }
  return path;
}

CameraPath line_path(Random& random, const LinePlan& plan) {
  constexpr int kKnots = 8;
  const double sway = 0.015 * (plan.to_m - plan.from_m).norm();
  const auto swayed = [&](const Vector3d& p, double amount) {
    const double dx = random.uniform(-amount, amount), dy = random.uniform(-amount, amount);
    const double dz = random.uniform(-0.4, 0.4) * amount;
    return Vector3d(p + Vector3d(dx, dy, dz));
  };
  CameraPath path;
  for (int k = 0; k < kKnots; ++k) {
    const double t = static_cast<double>(k) / (kKnots - 1);
    path.eye_m.push_back(swayed(plan.from_m + t * (plan.to_m - plan.from_m), sway));
    path.target_m.push_back(
        swayed(plan.look_from_m + t * (plan.look_to_m - plan.look_from_m), 4 * sway));
  }
  return path;
}

}  // namespace

void arc_walk(SceneBuilder& b, Epoch epoch, int frames, const WalkPlan& plan) {
  b.scene.path[static_cast<int>(epoch)] = arc_path(b.random, plan);
  b.scene.frames[static_cast<int>(epoch)] = frames;
}

void line_walk(SceneBuilder& b, Epoch epoch, int frames, const LinePlan& plan) {
  b.scene.path[static_cast<int>(epoch)] = line_path(b.random, plan);
  b.scene.frames[static_cast<int>(epoch)] = frames;
}

std::vector<Rigid3> sample_path(const SyntheticScene& scene, Epoch epoch, int frames) {
  const CameraPath& path = scene.path[static_cast<int>(epoch)];
  Random random(scene.key, {0x7A1C, static_cast<uint64_t>(epoch)});
  const double hurry = random.uniform(0.04, 0.09), phase = random.uniform(0, 6.28);
  std::vector<Rigid3> cameras;
  for (int frame = 0; frame < frames; ++frame) {
    const double even = frames > 1 ? static_cast<double>(frame) / (frames - 1) : 0.0;
    // Monotone for hurry < 1 / (2 pi): the walker slows down and hurries, but never turns back.
    const double t =
        even + hurry * (std::sin(2 * std::numbers::pi * even + phase) - std::sin(phase));
    Rigid3 camera_from_world = look_at(spline(path.eye_m, t), spline(path.target_m, t));
    const Vector3d shake_deg{0.8 * random.normal(), 0.8 * random.normal(), 1.0 * random.normal()};
    for (int axis = 0; axis < 3; ++axis) {
      camera_from_world = turned(Vector3d::Unit(axis), shake_deg[axis]) * camera_from_world;
    }
    cameras.push_back(camera_from_world);
  }
  return cameras;
}

}  // namespace vggtcd
