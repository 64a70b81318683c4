// SPDX-License-Identifier: Apache-2.0
// Nearest pairs between two oriented clouds under a similarity, in both directions.
#include "vggtcd/registration/surface_pairs.h"

#include <cmath>

#include "vggtcd/registration/map_points.h"

namespace vggtcd {
SurfaceMatcher::SurfaceMatcher(const OrientedPoints& t1, const OrientedPoints& t2)
    : t1_(t1), t2_(t2), index_t1_(t1.positions), index_t2_(t2.positions) {}

std::vector<SurfacePair> SurfaceMatcher::pairs(const Sim3& t2_from_t1, bool both) const {
  const NearestNeighbors of_t1 = index_t2_.query(map_points(t2_from_t1, t1_.positions));
  std::vector<SurfacePair> result;
  result.reserve(t1_.size() + t2_.size());
  const auto add = [&](size_t i1, size_t i2, bool search_from_t1) {
    SurfacePair pair;
    pair.moving = t2_from_t1 * t1_.positions[i1].cast<double>();
    pair.fixed = t2_.positions[i2].cast<double>();
    const Eigen::Vector3d normal1 = t2_from_t1.rotation * t1_.normals[i1].cast<double>();
    const Eigen::Vector3d normal2 = t2_.normals[i2].cast<double>();
    pair.normal = search_from_t1 ? normal2 : normal1;
    pair.distance = (pair.moving - pair.fixed).norm();
    pair.normal_cosine = std::abs(normal1.dot(normal2));
    pair.frame_t1 = t1_.frames[i1];
    pair.frame_t2 = t2_.frames[i2];
    pair.from_t1 = search_from_t1;
    result.push_back(pair);
  };
  for (size_t i = 0; i < t1_.size(); ++i) add(i, static_cast<size_t>(of_t1.index[i]), true);
  if (!both) return result;
  const NearestNeighbors of_t2 = index_t1_.query(map_points(t2_from_t1.inverse(), t2_.positions));
  for (size_t i = 0; i < t2_.size(); ++i) add(static_cast<size_t>(of_t2.index[i]), i, false);
  return result;
}

}  // namespace vggtcd
