// SPDX-License-Identifier: Apache-2.0
// When a classical reconstruction may be believed. A small reprojection error says nothing: a scene
// flattened onto a plane has one, too.
#include "vggtcd/reconstruction/trust.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "vggtcd/geometry/order_statistics.h"

namespace vggtcd {
namespace {

double widest_angle_deg(const SfmPoint& point, const std::vector<Eigen::Vector3d>& centers) {
  double widest = 0;
  for (size_t i = 0; i < point.views.size(); ++i) {
    const Eigen::Vector3d a = centers[static_cast<size_t>(point.views[i])] - point.x_in_world;
    for (size_t j = i + 1; j < point.views.size(); ++j) {
      const Eigen::Vector3d b = centers[static_cast<size_t>(point.views[j])] - point.x_in_world;
      widest = std::max(widest, std::atan2(a.cross(b).norm(), a.dot(b)));
    }
  }
  return widest * 180.0 / std::numbers::pi;
}

void require_placed(int placed, int photos, const char* epoch, const TrustOptions& options) {
  const bool enough = placed >= options.min_photos && placed >= options.min_placed_share * photos;
  if (enough) return;
  throw_error(
      ErrorCode::kDegenerate,
      "classical reconstruction refused: {} of {} {} photos could be placed in one model with "
      "the other epoch, at least {} and {:.0f} % are needed; take ten or more overlapping "
      "photos of textured surfaces per epoch, or use network weights (--weights)",
      placed, photos, epoch, options.min_photos, 100 * options.min_placed_share);
}

}  // namespace

SfmTrust measure_trust(const SfmResult& sfm, int photos_t1, int photos_t2) {
  SfmTrust trust;
  trust.photos_t1 = photos_t1;
  trust.photos_t2 = photos_t2;
  std::vector<bool> placed(static_cast<size_t>(photos_t1 + photos_t2));
  std::vector<bool> is_before;
  std::vector<Eigen::Vector3d> centers;
  for (size_t i = 0; i < sfm.model.views.size(); ++i) {
    const int photo = sfm.photo_of_view[i];
    placed[static_cast<size_t>(photo)] = true;
    is_before.push_back(photo < photos_t1);
    ++(is_before.back() ? trust.placed_t1 : trust.placed_t2);
    centers.push_back(camera_center(sfm.model.views[i].camera_from_world));
  }
  std::vector<double> angles, planar;
  for (const SfmPoint& point : sfm.model.points) {
    angles.push_back(widest_angle_deg(point, centers));
    bool before = false, after = false;
    for (const int view : point.views) {
      (is_before[static_cast<size_t>(view)] ? before : after) = true;
    }
    if (before && after) ++trust.shared_points;
  }
  for (const PhotoPair& pair : sfm.pairs) {
    if (!placed[static_cast<size_t>(pair.first)] || !placed[static_cast<size_t>(pair.second)]) {
      continue;
    }
    planar.push_back(static_cast<double>(pair.homography_inliers) /
                     static_cast<double>(pair.matches.size()));
  }
  if (!angles.empty()) trust.median_angle_deg = middle_of(std::move(angles));
  if (!planar.empty()) trust.homography_share = middle_of(std::move(planar));
  return trust;
}

void require_photos(int photos_t1, int photos_t2, const TrustOptions& options) {
  if (std::min(photos_t1, photos_t2) >= options.min_photos) return;
  throw_error(
      ErrorCode::kDegenerate,
      "classical reconstruction refused: {} photos before and {} after, at least {} of each "
      "are needed; take ten or more overlapping photos of textured surfaces per epoch, or "
      "use network weights (--weights)",
      photos_t1, photos_t2, options.min_photos);
}

void require_trust(const SfmTrust& trust, const TrustOptions& options) {
  if (trust.placed_t1 + trust.placed_t2 == 0) {
    throw_error(ErrorCode::kDegenerate,
                "classical reconstruction refused: no two of the {} photos show the same textured "
                "surfaces from different places; take ten or more overlapping photos per epoch, or "
                "use network weights (--weights)",
                trust.photos_t1 + trust.photos_t2);
  }
  if (trust.placed_t1 == 0 || trust.placed_t2 == 0) {
    throw_error(
        ErrorCode::kDegenerate,
        "classical reconstruction refused: nothing in the {} photos was found again in the {} "
        "photos; are these two sets of the same place, with overlapping views?",
        trust.placed_t1 == 0 ? "before" : "after", trust.placed_t1 == 0 ? "after" : "before");
  }
  require_placed(trust.placed_t1, trust.photos_t1, "before", options);
  require_placed(trust.placed_t2, trust.photos_t2, "after", options);
  if (trust.shared_points < options.min_shared_points) {
    throw_error(
        ErrorCode::kDegenerate,
        "classical reconstruction refused: the epochs share {} points, at least {} are needed "
        "to put them into one frame; take photos of the same parts of the place in both",
        trust.shared_points, options.min_shared_points);
  }
  if (trust.median_angle_deg < options.min_angle_deg) {
    throw_error(ErrorCode::kDegenerate,
                "classical reconstruction refused: points are seen under {:.1f} degrees, at least "
                "{:.1f} are needed; walk sideways between photos instead of turning on the spot",
                trust.median_angle_deg, options.min_angle_deg);
  }
  if (trust.homography_share > options.max_homography_share) {
    throw_error(
        ErrorCode::kDegenerate,
        "classical reconstruction refused: a plane explains {:.0f} % of the matches (at most "
        "{:.0f} % is trusted), so depth is not determined; show surfaces at different "
        "distances, or walk sideways between photos",
        100 * trust.homography_share, 100 * options.max_homography_share);
  }
}

void require_depth(double known_share, const char* epoch, const TrustOptions& options) {
  if (known_share >= options.min_consistent_share) return;
  throw_error(
      ErrorCode::kDegenerate,
      "classical reconstruction refused: photos agree on the depth of {:.0f} % of the pixels of "
      "the {} epoch, at least {:.0f} % is needed; take more photos from closer together, of "
      "textured surfaces, or use network weights (--weights)",
      100 * known_share, epoch, 100 * options.min_consistent_share);
}

}  // namespace vggtcd
