// SPDX-License-Identifier: Apache-2.0
// Nearest pairs between two oriented clouds under a similarity, in both directions.
#include "vggtcd/registration/surface_pairs.h"

#include <algorithm>
#include <cmath>

#include "vggtcd/registration/map_points.h"

namespace vggtcd {
namespace {

int32_t count_of(const std::vector<int32_t>& frames) {
  return frames.empty() ? 0 : *std::max_element(frames.begin(), frames.end()) + 1;
}

}  // namespace

SurfaceMatcher::SurfaceMatcher(const OrientedPoints& t1, const OrientedPoints& t2)
    : t1_(t1), t2_(t2), index_t1_(t1.positions), index_t2_(t2.positions) {
  first_t2_cluster_ = count_of(t1.frames);
  num_clusters_ = first_t2_cluster_ + count_of(t2.frames);
}

std::vector<SurfacePair> SurfaceMatcher::pairs(const Sim3& t2_from_t1) const {
  const Sim3 t1_from_t2 = t2_from_t1.inverse();
  const NearestNeighbors of_t1 = index_t2_.query(map_points(t2_from_t1, t1_.positions));
  const NearestNeighbors of_t2 = index_t1_.query(map_points(t1_from_t2, t2_.positions));
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
    pair.cluster = search_from_t1 ? t1_.frames[i1] : first_t2_cluster_ + t2_.frames[i2];
    result.push_back(pair);
  };
  for (size_t i = 0; i < t1_.size(); ++i) add(i, static_cast<size_t>(of_t1.index[i]), true);
  for (size_t i = 0; i < t2_.size(); ++i) add(static_cast<size_t>(of_t2.index[i]), i, false);
  return result;
}

}  // namespace vggtcd
