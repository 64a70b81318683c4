// SPDX-License-Identifier: Apache-2.0
// A room with boxes and balls, ray cast in closed form.
#include "bench/depth_scene.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "vggtcd/core/parallel.h"

namespace vggtcd::bench {
namespace {

using Vec = Eigen::Vector3d;
constexpr int kWidth = 518, kHeight = 392;
const Vec kRoomLow(-3, -2.5, 0), kRoomHigh(3, 2.5, 2.8);  // m, z up

struct Object {
  Vec center, half_size;
  bool is_ball;  // of radius half_size.x()
};

// Distances along the ray at which it enters and leaves an axis-aligned box.
std::pair<double, double> box_interval(const Vec& origin, const Vec& direction, const Vec& low,
                                       const Vec& high) {
  const Eigen::Array3d a = (low - origin).array() / direction.array();
  const Eigen::Array3d b = (high - origin).array() / direction.array();
  return {a.min(b).maxCoeff(), a.max(b).minCoeff()};
}

double hit_distance(const Vec& origin, const Vec& direction, const std::vector<Object>& objects) {
  double nearest = box_interval(origin, direction, kRoomLow, kRoomHigh).second;
  for (const Object& object : objects) {
    const Vec to_center = object.center - origin;
    if (object.is_ball) {
      const double along = to_center.dot(direction);
      const double room = object.half_size.x() * object.half_size.x() -
                          (to_center - along * direction).squaredNorm();
      if (room > 0 && along > 0) nearest = std::min(nearest, along - std::sqrt(room));
    } else {
      const auto [enter, leave] = box_interval(origin, direction, object.center - object.half_size,
                                               object.center + object.half_size);
      if (enter > 0 && enter < leave) nearest = std::min(nearest, enter);
    }
  }
  return nearest;
}

std::vector<Object> make_objects(uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<Object> objects;
  for (int i = 0; i < 16; ++i) {
    const double size = 0.1 + 0.35 * uniform(random);
    Vec half(size, size * (0.5 + uniform(random)), size * (0.5 + uniform(random)));
    const double angle = 2 * std::numbers::pi * uniform(random), radius = 0.3 + uniform(random);
    objects.push_back(
        {{radius * std::cos(angle), radius * std::sin(angle), half.z()}, half, i % 3 == 0});
  }
  return objects;
}

View make_view(int frame, int frames, double phase) {
  const double angle = 2 * std::numbers::pi * (frame + phase) / frames;
  const Vec center(2.4 * std::cos(angle), 2.0 * std::sin(angle), 1.5 + 0.3 * std::sin(5 * angle));
  const Vec target(0.5 * std::sin(3 * angle), 0.5 * std::cos(2 * angle), 0.7);
  const Vec forward = (target - center).normalized();
  const Vec right = forward.cross(Vec::UnitZ()).normalized();
  Eigen::Matrix3d camera_from_world;
  camera_from_world << right.transpose(), forward.cross(right).transpose(), forward.transpose();
  View view;
  view.camera_from_world = {camera_from_world, -(camera_from_world * center)};
  view.pinhole = {430, 430, kWidth / 2.0, kHeight / 2.0, kWidth, kHeight};
  return view;
}

// Depth and confidence of one frame, in metres.
void render(const View& view, const std::vector<Object>& objects, uint64_t seed, float* depth,
            float* confidence) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0, 1);
  const Vec origin = camera_center(view.camera_from_world);
  const double factor = 1 + 0.005 * normal(random), phase = 10 * uniform(random);
  double previous = 0;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u, ++depth, ++confidence) {
      const Vec in_camera = view.pinhole.unproject(u, v, 1);
      const Vec direction = (view.camera_from_world.rotation.transpose() * in_camera).normalized();
      const double exact = hit_distance(origin, direction, objects) / in_camera.norm();
      const double wave = 0.005 * std::sin(phase + 0.012 * u) * std::cos(phase + 0.015 * v);
      double seen = exact * (factor + wave + 0.002 * normal(random));
      const bool at_edge = u > 0 && std::abs(exact - previous) > 0.05 * exact;
      if (at_edge || uniform(random) < 0.005) seen *= 1 - 0.3 * uniform(random);
      previous = exact;
      *depth = static_cast<float>(seen);
      *confidence = static_cast<float>(1 + (at_edge ? 0.5 : 10 + normal(random)) / (1 + exact));
    }
  }
}

Reconstruction make_epoch(int frames, double phase, const std::vector<Object>& objects,
                          const Sim3& epoch_from_room, uint64_t seed) {
  Reconstruction epoch;
  epoch.width = kWidth;
  epoch.height = kHeight;
  for (int i = 0; i < frames; ++i) epoch.views.push_back(make_view(i, frames, phase));
  epoch.depth.resize(epoch.num_pixels());
  epoch.confidence.resize(epoch.num_pixels());
  epoch.color.resize(3 * epoch.num_pixels());
  parallel_for(frames, 1, [&](int64_t frame, int64_t) {
    View& view = epoch.views[static_cast<size_t>(frame)];
    const size_t first = static_cast<size_t>(frame) * epoch.pixels_per_frame();
    render(view, objects, seed + static_cast<uint64_t>(frame), &epoch.depth[first],
           &epoch.confidence[first]);
    view.camera_from_world = camera_from_new_world(view.camera_from_world, epoch_from_room);
    for (size_t i = first; i < first + epoch.pixels_per_frame(); ++i) {
      epoch.depth[i] *= static_cast<float>(epoch_from_room.scale);
    }
  });
  return epoch;
}

}  // namespace

DepthScene make_depth_scene(int frames, uint64_t seed) {
  std::vector<Object> objects = make_objects(seed);
  const Sim3 t1_from_room{
      0.3, Eigen::AngleAxisd(0.4, Vec(1, 2, 3).normalized()).toRotationMatrix(), {0.1, -0.2, 0.7}};
  const Sim3 t2_from_room{
      0.25, Eigen::AngleAxisd(-0.9, Vec(3, 1, 2).normalized()).toRotationMatrix(), {0.5, 0, -0.1}};
  DepthScene scene;
  scene.before = make_epoch(frames, 0, objects, t1_from_room, seed + 1000);
  for (size_t i = 0; i < 3; ++i) objects[5 * i].center += Vec(0.4, -0.3, 0);
  scene.after = make_epoch(frames, 0.4, objects, t2_from_room, seed + 2000);
  scene.t2_from_t1 = t2_from_room * t1_from_room.inverse();
  return scene;
}

}  // namespace vggtcd::bench
