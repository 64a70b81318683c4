// SPDX-License-Identifier: Apache-2.0
// Pose encoding -> camera.
#include "vggtcd/geometry/pose_encoding.h"

#include <cmath>

namespace vggtcd {

Eigen::Matrix3d rotation_from_quaternion(const Eigen::Vector4d& xyzw) {
  const double x = xyzw[0], y = xyzw[1], z = xyzw[2], w = xyzw[3];
  const double s = 2.0 / xyzw.squaredNorm();
  Eigen::Matrix3d rotation;
  rotation << 1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w),  //
      s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w),          //
      s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y);
  return rotation;
}

Rigid3 camera_from_world_of(std::span<const float, 9> encoding) {
  const Eigen::Vector4d xyzw(encoding[3], encoding[4], encoding[5], encoding[6]);
  return {rotation_from_quaternion(xyzw), {encoding[0], encoding[1], encoding[2]}};
}

Pinhole pinhole_of(std::span<const float, 9> encoding, int height, int width) {
  Pinhole pinhole;
  pinhole.fy = height / 2.0 / std::tan(encoding[7] / 2.0);
  pinhole.fx = width / 2.0 / std::tan(encoding[8] / 2.0);
  pinhole.cx = width / 2.0;
  pinhole.cy = height / 2.0;
  pinhole.width = width;
  pinhole.height = height;
  return pinhole;
}

}  // namespace vggtcd
