// SPDX-License-Identifier: Apache-2.0
// A toy reconstruction for tests: a few cameras looking at a bumpy relief, exact depth, in any
// frame.
#include "tests/support/toy_scene.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

#include "vggtcd/core/error.h"

namespace vggtcd::testing_support {
namespace {

// The distance z along a ray to the relief, by bisection between the planes z = 4 and z = 6: the
// relief is a height field seen from in front, steep only where a test makes it so.
double depth_along(const ToyScene& scene, const Eigen::Vector3d& origin,
                   const Eigen::Vector3d& ray) {
  const auto above_surface = [&](double t) {
    const Eigen::Vector3d x = origin + t * ray;
    return x.z() < 5.0 - scene.relief(x.x(), x.y());
  };
  constexpr int kSteps = 400;
  double near = 3.9, far = 6.1;
  for (int i = 1; i <= kSteps; ++i) {  // the first crossing
    const double t = 3.9 + (6.1 - 3.9) * i / kSteps;
    if (!above_surface(t)) {
      far = t;
      break;
    }
    near = t;
  }
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (near + far);
    (above_surface(middle) ? near : far) = middle;
  }
  return 0.5 * (near + far);
}

}  // namespace

uint8_t checkerboard(double x, double y) {
  const int checker = static_cast<int>(std::floor(2 * x) + std::floor(2 * y)) & 1;
  return static_cast<uint8_t>(60 + 120 * checker);
}

uint8_t mottled(double x, double y) {
  const auto at_corner = [](int column, int row) {
    std::minstd_rand random(static_cast<unsigned>(100'003 + 37 * column + 1009 * row));
    random.discard(5);
    return static_cast<double>(random() % 1000) / 1000 - 0.5;
  };
  double gray = 128;
  for (const double cell : {0.6, 0.3, 0.15}) {
    const double u = x / cell, v = y / cell;
    const int column = static_cast<int>(std::floor(u)), row = static_cast<int>(std::floor(v));
    const double right = u - column, down = v - row;
    gray +=
        80 *
        ((1 - down) * ((1 - right) * at_corner(column, row) + right * at_corner(column + 1, row)) +
         down *
             ((1 - right) * at_corner(column, row + 1) + right * at_corner(column + 1, row + 1)));
  }
  return static_cast<uint8_t>(std::clamp(gray, 0.0, 255.0));
}

double flat_relief(double, double) { return 0.0; }
double box_relief(double x, double y) {
  return x > 0.2 && x < 0.8 && std::abs(y) < 0.3 ? 0.5 : 0.0;
}

const Sim3 kT2FromT1{
    1.7,
    Eigen::AngleAxisd(0.8, Eigen::Vector3d(1, 1, 1).normalized()).toRotationMatrix(),
    {3, 2, 1}};

Reconstruction reconstruct(const ToyScene& scene, const Sim3& frame_from_scene) {
  Reconstruction r;
  r.width = scene.width;
  r.height = scene.height;
  const double focal = 0.9 * scene.width;
  for (int frame = 0; frame < scene.frames; ++frame) {
    View view;
    view.name = "frame_" + std::to_string(frame);
    view.pinhole = {focal, focal, 0.5 * scene.width, 0.5 * scene.height, scene.width, scene.height};
    const Eigen::Vector3d center(scene.camera_offset + 0.4 * frame, 0.1 * (frame % 2), 0);
    Rigid3 camera_from_scene;
    camera_from_scene.rotation =
        Eigen::AngleAxisd(0.05 * (frame - 1), Eigen::Vector3d::UnitY()).toRotationMatrix();
    camera_from_scene.translation = -(camera_from_scene.rotation * center);
    for (int v = 0; v < scene.height; ++v) {
      for (int u = 0; u < scene.width; ++u) {
        const Eigen::Vector3d ray =
            camera_from_scene.rotation.transpose() * view.pinhole.unproject(u, v, 1.0);
        const double depth = depth_along(scene, center, ray);
        const Eigen::Vector3d x = center + depth * ray;
        const double off_center = std::hypot(u - view.pinhole.cx, v - view.pinhole.cy);
        r.depth.push_back(static_cast<float>(frame_from_scene.scale * depth));
        r.confidence.push_back(static_cast<float>(1.0 + 100.0 / (1.0 + off_center)));
        r.color.insert(r.color.end(), 3, scene.gray(x.x(), x.y()));
      }
    }
    view.camera_from_world = camera_from_new_world(camera_from_scene, frame_from_scene);
    r.views.push_back(view);
  }
  check_consistent(r);
  return r;
}

}  // namespace vggtcd::testing_support
