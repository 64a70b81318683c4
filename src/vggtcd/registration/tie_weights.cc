// SPDX-License-Identifier: Apache-2.0
// How much each tie point counts under a similarity, and how well a similarity fits them.
#include "vggtcd/registration/tie_weights.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "vggtcd/core/error.h"
#include "vggtcd/geometry/order_statistics.h"

namespace vggtcd {
namespace {

constexpr double kMedianOfChiSquared3 = 2.366;
// Ties are never believed to be better than half of the deviation they promise.
constexpr double kLeastVariance = 0.25;
// Tukey's constant is for one residual; three reach farther at the same efficiency.
constexpr double kTukeyWidening = 1.225;
constexpr int64_t kMinAgreeing = 6;  // ties of a pair of photos; fewer may be chance

PointPair under(const TiePoint& tie, const Sim3& t2_from_t1) {
  const Eigen::Matrix3d axes = t2_from_t1.scale * t2_from_t1.rotation;
  const auto mapped = [&](PhotoNumber photo, const Eigen::Vector3d& x) {
    return photo.of_t1 ? t2_from_t1 * x : x;
  };
  const auto turned = [&](PhotoNumber photo, const Eigen::Matrix3d& covariance) {
    return photo.of_t1 ? Eigen::Matrix3d(axes * covariance * axes.transpose()) : covariance;
  };
  return {tie.first_photo, tie.second_photo, mapped(tie.first_photo, tie.first),
          mapped(tie.second_photo, tie.second),
          (turned(tie.first_photo, tie.first_covariance) +
           turned(tie.second_photo, tie.second_covariance))
              .inverse()};
}

double squared_distance(const PointPair& point, const Eigen::Vector3d& difference) {
  return difference.dot(point.information * difference);
}

bool same_photo(PhotoNumber a, PhotoNumber b) { return a.of_t1 == b.of_t1 && a.frame == b.frame; }

bool same_photos(const TiePoint& a, const TiePoint& b) {
  return same_photo(a.first_photo, b.first_photo) && same_photo(a.second_photo, b.second_photo);
}

// Of one pair of photos.
void append_agreeing(std::span<const TiePoint> pair, const Sim3& t2_from_t1,
                     std::vector<TiePoint>& kept) {
  std::array<std::vector<double>, 3> axis;
  std::vector<PointPair> points;
  for (const TiePoint& tie : pair) {
    const PointPair& point = points.emplace_back(under(tie, t2_from_t1));
    for (size_t k = 0; k < 3; ++k) {
      const auto row = static_cast<Eigen::Index>(k);
      axis[k].push_back(point.first[row] - point.second[row]);
    }
  }
  const Eigen::Vector3d common(middle_of(axis[0]), middle_of(axis[1]), middle_of(axis[2]));
  constexpr double kReach = 3 * 4.685 * kTukeyWidening;
  const auto agrees = [&](const PointPair& point) {
    return squared_distance(point, point.first - point.second - common) < kReach * kReach;
  };
  const auto agreeing = std::ranges::count_if(points, agrees);
  if (agreeing < kMinAgreeing || 2 * agreeing < std::ssize(pair)) return;
  for (size_t i = 0; i < pair.size(); ++i) {
    if (agrees(points[i])) kept.push_back(pair[i]);
  }
}

double tukey_sigma(double variance) { return kTukeyWidening * std::sqrt(variance); }

}  // namespace

WeighedTies weigh_ties(std::span<const TiePoint> ties, const Sim3& t2_from_t1,
                       const PhotoErrors* photos, const Vector7& theta) {
  WeighedTies result;
  if (ties.empty()) return result;
  std::vector<double> distances;  // squared
  for (const TiePoint& tie : ties) {
    const PointPair& point = result.points.emplace_back(under(tie, t2_from_t1));
    Eigen::Vector3d difference = point.first - point.second;
    if (photos) difference += photos->displacement(point, theta);
    distances.push_back(squared_distance(point, difference));
  }
  result.variance = std::max(middle_of(distances) / kMedianOfChiSquared3, kLeastVariance);
  for (size_t i = 0; i < ties.size(); ++i) {
    const double weight = tukey_weight(std::sqrt(distances[i]), tukey_sigma(result.variance));
    result.points[i].information *= weight / result.variance;
    result.used += weight > 0 && ties[i].across() ? 1 : 0;
  }
  return result;
}

std::vector<TiePoint> agreeing_ties(std::span<const TiePoint> ties, const Sim3& t2_from_t1) {
  std::vector<TiePoint> kept;
  for (size_t first = 0; first < ties.size();) {
    size_t last = first + 1;
    while (last < ties.size() && same_photos(ties[first], ties[last])) ++last;
    append_agreeing(ties.subspan(first, last - first), t2_from_t1, kept);
    first = last;
  }
  return kept;
}

double tie_cost(std::span<const TiePoint> ties, const Sim3& t2_from_t1, double variance) {
  check(variance > 0, "tie_cost: a positive variance");
  double sum = 0;
  int64_t across = 0;
  for (const TiePoint& tie : ties) {
    if (!tie.across()) continue;
    const PointPair point = under(tie, t2_from_t1);
    sum += tukey_loss(std::sqrt(squared_distance(point, point.first - point.second)),
                      tukey_sigma(variance));
    ++across;
  }
  check(across > 0, "tie_cost: ties between the epochs");
  return sum / static_cast<double>(across);
}

}  // namespace vggtcd
