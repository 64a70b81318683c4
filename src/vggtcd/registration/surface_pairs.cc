// SPDX-License-Identifier: Apache-2.0
// Nearest pairs between two oriented clouds under a similarity, in both directions.
#include "vggtcd/registration/surface_pairs.h"

#include <cmath>

#include "vggtcd/core/parallel.h"
#include "vggtcd/geometry/order_statistics.h"
#include "vggtcd/registration/map_points.h"

namespace vggtcd {

double median_over(const std::vector<SurfacePair>& pairs, double (*value)(const SurfacePair&)) {
  std::vector<float> values(pairs.size());
  constexpr int64_t kGrain = 1 << 14;
  parallel_for(static_cast<int64_t>(pairs.size()), kGrain, [&](int64_t begin, int64_t end) {
    for (size_t i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
      values[i] = static_cast<float>(value(pairs[i]));
    }
  });
  return values.empty() ? 0 : static_cast<double>(median(values));
}

SurfaceMatcher::SurfaceMatcher(const OrientedPoints& t1, const OrientedPoints& t2,
                               double common_depth_u)
    : t1_(t1),
      t2_(t2),
      common_depth_u_(common_depth_u),
      index_t1_(t1.positions),
      index_t2_(t2.positions) {}

std::vector<SurfacePair> SurfaceMatcher::pairs(const Sim3& t2_from_t1, bool both) const {
  std::vector<SurfacePair> result;
  pairs(t2_from_t1, both, 1, result);
  return result;
}

void SurfaceMatcher::pairs(const Sim3& t2_from_t1, bool both, int stride,
                           std::vector<SurfacePair>& result) const {
  const auto step = static_cast<size_t>(stride);
  const size_t from_t1 = (t1_.size() + step - 1) / step, from_t2 = (t2_.size() + step - 1) / step;
  result.resize(from_t1 + (both ? from_t2 : 0));
  const auto pair_of = [&](size_t i1, size_t i2, bool search_from_t1) {
    SurfacePair pair;
    pair.moving = t2_from_t1 * t1_.positions[i1].cast<double>();
    pair.fixed = t2_.positions[i2].cast<double>();
    const Eigen::Vector3d normal1 = t2_from_t1.rotation * t1_.normals[i1].cast<double>();
    const Eigen::Vector3d normal2 = t2_.normals[i2].cast<double>();
    pair.normal = search_from_t1 ? normal2 : normal1;
    pair.distance = (pair.moving - pair.fixed).norm();
    const double cosine = normal1.dot(normal2);
    pair.normal_cosine = std::abs(cosine);
    pair.own_normal =
        ((cosine < 0 ? -1.0 : 1.0) * (search_from_t1 ? normal1 : normal2)).cast<float>();
    pair.frame_t1 = t1_.frames[i1];
    pair.frame_t2 = t2_.frames[i2];
    pair.from_t1 = search_from_t1;
    if (common_depth_u_ > 0) {
      pair.depth_u = common_depth_u_;
    } else {
      const Eigen::Vector3d camera1 = t2_from_t1 * t1_.cameras[static_cast<size_t>(pair.frame_t1)];
      const Eigen::Vector3d& camera2 = t2_.cameras[static_cast<size_t>(pair.frame_t2)];
      pair.depth_u = std::sqrt(
          0.5 * ((pair.moving - camera1).squaredNorm() + (pair.fixed - camera2).squaredNorm()));
    }
    return pair;
  };
  constexpr int64_t kGrain = 1 << 13;
  const NearestNeighbors of_t1 = index_t2_.query(map_points(t2_from_t1, t1_.positions, stride));
  parallel_for(static_cast<int64_t>(from_t1), kGrain, [&](int64_t begin, int64_t end) {
    for (size_t i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
      result[i] = pair_of(i * step, static_cast<size_t>(of_t1.index[i]), true);
    }
  });
  if (!both) return;
  const NearestNeighbors of_t2 =
      index_t1_.query(map_points(t2_from_t1.inverse(), t2_.positions, stride));
  parallel_for(static_cast<int64_t>(from_t2), kGrain, [&](int64_t begin, int64_t end) {
    for (size_t i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
      result[from_t1 + i] = pair_of(static_cast<size_t>(of_t2.index[i]), i * step, false);
    }
  });
}

}  // namespace vggtcd
