// SPDX-License-Identifier: Apache-2.0
// Nearest pairs between two oriented clouds under a similarity, in both directions.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "vggtcd/geometry/nearest_neighbors.h"
#include "vggtcd/geometry/sim3.h"
#include "vggtcd/scene/oriented_points.h"

namespace vggtcd {

// A point of T1 (already mapped into T2) and a point of T2 with the normal of the surface that was
// searched, all in T2.
struct SurfacePair {
  Eigen::Vector3d moving;    // from T1
  Eigen::Vector3d fixed;     // from T2
  Eigen::Vector3d normal;    // of the target surface
  double distance = 0;       // between the points
  double normal_cosine = 0;  // |cos| between the two surfaces' normals
  double depth_u = 1;        // root mean square of the points' distances from their cameras
  // Of the searching surface, on the side of `normal`: its error is another one.
  Eigen::Vector3f own_normal = Eigen::Vector3f::Zero();
  int32_t frame_t1 = 0;  // the photos the two points were taken from
  int32_t frame_t2 = 0;
  bool from_t1 = true;  // the searching point is T1's

  double plane_residual() const { return normal.dot(moving - fixed); }
};

// The median of what `value` reads from each pair, as float; 0 without pairs.
double median_over(const std::vector<SurfacePair>& pairs, double (*value)(const SurfacePair&));

class SurfaceMatcher {
 public:
  // The clouds must outlive the matcher. common_depth_u: the depth of every pair; 0: its own.
  SurfaceMatcher(const OrientedPoints& t1, const OrientedPoints& t2, double common_depth_u = 0);

  // One pair per point of T1, then, with `both`, one per point of T2.
  std::vector<SurfacePair> pairs(const Sim3& t2_from_t1, bool both = true) const;
  // The same into memory that is used again: at full size it takes as long to get as to fill. Only
  // every stride-th point of either cloud searches, among all of the other.
  void pairs(const Sim3& t2_from_t1, bool both, int stride, std::vector<SurfacePair>& result) const;

 private:
  const OrientedPoints& t1_;
  const OrientedPoints& t2_;
  double common_depth_u_;
  NearestNeighborIndex index_t1_;  // in T1's own frame: it does not move
  NearestNeighborIndex index_t2_;
};

}  // namespace vggtcd
