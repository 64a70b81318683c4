// SPDX-License-Identifier: Apache-2.0
// RayCaster: the triangles of one epoch of a scene, asked by rays. On Embree 3.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>

#include "vggtcd/evaluation/synthetic/scene.h"

namespace vggtcd {

struct RayHit {
  double distance_m = 0;  // along the unit direction
  int object = 0;         // index into the scene's objects
  int material = 0;
  uint32_t face = 0;
  Eigen::Vector3f position_in_object_m;
  Eigen::Vector2f uv_m;
  Eigen::Vector3f normal;  // world, facing the ray's origin
};

// Thread-safe once built. Embree's vector code is pinned to one instruction set, and distances are
// recomputed from the triangle in double, so that every processor gives the same answers.
class RayCaster {
 public:
  RayCaster(const SyntheticScene& scene, Epoch epoch);
  ~RayCaster();
  RayCaster(const RayCaster&) = delete;
  RayCaster& operator=(const RayCaster&) = delete;

  // The first surface along a ray of unit direction, or nothing (the sky).
  std::optional<RayHit> cast(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;
  // Whether anything lies strictly between two points, leaving out 2 mm at the far end.
  bool blocked(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const;
  // Whether a surface lies within this distance of the point.
  bool surface_within(const Eigen::Vector3d& point, double distance_m) const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace vggtcd
