// SPDX-License-Identifier: Apache-2.0
// Pinhole: intrinsics without distortion. Pixel centres are integers: u = fx x / z + cx.
#pragma once

#include <Eigen/Core>

namespace vggtcd {

struct Pinhole {
  double fx = 0, fy = 0;  // px
  double cx = 0, cy = 0;  // px
  int width = 0, height = 0;

  // The point at this pixel and depth, in camera axes (x right, y down, z forward).
  Eigen::Vector3d unproject(double u_px, double v_px, double depth) const {
    return {(u_px - cx) * depth / fx, (v_px - cy) * depth / fy, depth};
  }
  // The pixel of a point in camera axes; meaningful for z > 0 only.
  Eigen::Vector2d project(const Eigen::Vector3d& x_in_camera) const {
    return {fx * x_in_camera.x() / x_in_camera.z() + cx,
            fy * x_in_camera.y() / x_in_camera.z() + cy};
  }
  // Whether the pixel nearest to (u, v) exists.
  bool contains(double u_px, double v_px) const {
    return u_px >= -0.5 && v_px >= -0.5 && u_px < width - 0.5 && v_px < height - 0.5;
  }
  Eigen::Matrix3d matrix() const {
    return (Eigen::Matrix3d() << fx, 0, cx, 0, fy, cy, 0, 0, 1).finished();
  }
};

}  // namespace vggtcd
