// SPDX-License-Identifier: Apache-2.0
// Tie points: SIFT key points of photos of both epochs, matched where the alignment expects them.
#include "vggtcd/registration/tie_points.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <utility>

#include "vggtcd/core/parallel.h"
#include "vggtcd/core/progress.h"
#include "vggtcd/features/features.h"
#include "vggtcd/scene/confidence.h"
#include "vggtcd/scene/keyframes.h"
#include "vggtcd/scene/view_overlap.h"

namespace vggtcd {
namespace {

constexpr int kMaxKeyPoints = 500;      // of a photo
constexpr int kMaxSide_px = 320;        // photos are shrunk to it: photos err more than key points
constexpr int kPairsPerPhoto = 4;       // chosen by each photo; a pair may be chosen by both
constexpr double kSearchShare = 0.08;   // of the photo's width: how far off a key point may be
constexpr double kMinConfidence = 15;   // percentile
constexpr float kMaxDepthStep = 0.06f;  // within 3 x 3 pixels, of the depth: another surface
constexpr double kKeyPointSigma_px = 0.7;
constexpr double kDepthSigma =
    0.05;  // far along a ray, of the depth: ties go by what is seen, not by it

// A key point in space: its pixel, depth and place in the epoch's frame.
struct Lifted {
  Eigen::Vector3d x = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

struct Photo {
  int frame = 0;
  Features features;
  std::vector<std::optional<Lifted>> lifted;  // per key point; none where it has no sure depth
};

std::optional<Lifted> lift(const Reconstruction& r, int frame, const KeyPoint& point,
                           double min_confidence) {
  const View& view = r.views[static_cast<size_t>(frame)];
  const int u = static_cast<int>(std::lround(point.u_px));
  const int v = static_cast<int>(std::lround(point.v_px));
  if (u < 1 || v < 1 || u >= r.width - 1 || v >= r.height - 1) return {};
  const auto at = [&](int column, int row) {
    return static_cast<size_t>(row) * static_cast<size_t>(r.width) + static_cast<size_t>(column);
  };
  const auto depths = r.frame_depth(frame);
  const float depth = depths[at(u, v)];
  if (!(depth > 0) || static_cast<double>(r.frame_confidence(frame)[at(u, v)]) < min_confidence)
    return {};
  float least = depth, most = depth;
  for (int row = v - 1; row <= v + 1; ++row) {
    for (int column = u - 1; column <= u + 1; ++column) {
      least = std::min(least, depths[at(column, row)]);
      most = std::max(most, depths[at(column, row)]);
    }
  }
  if (most - least > kMaxDepthStep * depth) return {};
  const Rigid3 world_from_camera = view.camera_from_world.inverse();
  const Eigen::Vector3d in_camera = view.pinhole.unproject(
      static_cast<double>(point.u_px), static_cast<double>(point.v_px), static_cast<double>(depth));
  const double distance = in_camera.norm();
  const Eigen::Vector3d ray = world_from_camera.rotation * in_camera / distance;
  const Eigen::Matrix3d along = ray * ray.transpose();
  const double shrink = std::max(1.0, std::max(r.width, r.height) / double{kMaxSide_px});
  const double across = shrink * kKeyPointSigma_px / view.pinhole.fx;
  Lifted lifted;
  lifted.x = world_from_camera * in_camera;
  lifted.covariance =
      distance * distance *
      (across * across * (Eigen::Matrix3d::Identity() - along) + kDepthSigma * kDepthSigma * along);
  return lifted;
}

std::vector<Photo> photos_of(const Reconstruction& r, const std::vector<int>& frames) {
  std::vector<Image> images;
  for (const int frame : frames) {
    Image& image = images.emplace_back(r.width, r.height);
    const auto color = r.frame_color(frame);
    std::copy(color.begin(), color.end(), image.rgb.begin());
  }
  ProgressStage silent(silent_progress(), "key points");
  std::vector<Features> features = extract_features(images, kMaxKeyPoints, silent, kMaxSide_px);
  const double min_confidence = confidence_percentile(r, kMinConfidence);
  std::vector<Photo> photos;
  for (size_t i = 0; i < frames.size(); ++i) {
    Photo& photo = photos.emplace_back(Photo{frames[i], std::move(features[i]), {}});
    for (const KeyPoint& point : photo.features.points)
      photo.lifted.push_back(lift(r, frames[i], point, min_confidence));
  }
  return photos;
}

// Where the other epoch's photo should show the key points.
std::vector<Eigen::Vector2f> expected(const Photo& photo, const Sim3& other_from_world,
                                      const View& other) {
  std::vector<Eigen::Vector2f> pixels(
      photo.lifted.size(), Eigen::Vector2f::Constant(std::numeric_limits<float>::quiet_NaN()));
  for (size_t i = 0; i < pixels.size(); ++i) {
    if (!photo.lifted[i]) continue;
    const Eigen::Vector3d x = other.camera_from_world * (other_from_world * photo.lifted[i]->x);
    if (x.z() > 0) pixels[i] = other.pinhole.project(x).cast<float>();
  }
  return pixels;
}

// Of each chosen photo the chosen photos of the other epoch that overlap it most, from both sides.
std::vector<std::pair<size_t, size_t>> overlapping_pairs(const Reconstruction& before,
                                                         const Reconstruction& after,
                                                         const Sim3& t2_from_t1,
                                                         const std::vector<int>& frames_t1,
                                                         const std::vector<int>& frames_t2) {
  std::set<std::pair<size_t, size_t>> pairs;
  const auto add = [&](const Reconstruction& from, const Reconstruction& to, const Sim3& to_from,
                       const std::vector<int>& frames, const std::vector<int>& others,
                       bool swapped) {
    const auto best = overlapping_views(from, to, to_from, to.num_frames());
    for (size_t i = 0; i < frames.size(); ++i) {
      int taken = 0;
      for (const int other : best[static_cast<size_t>(frames[i])]) {
        const auto found = std::lower_bound(others.begin(), others.end(), other);
        if (found == others.end() || *found != other) continue;
        const auto j = static_cast<size_t>(found - others.begin());
        pairs.insert(swapped ? std::pair(j, i) : std::pair(i, j));
        if (++taken == kPairsPerPhoto) break;
      }
    }
  };
  add(before, after, t2_from_t1, frames_t1, frames_t2, false);
  add(after, before, t2_from_t1.inverse(), frames_t2, frames_t1, true);
  return {pairs.begin(), pairs.end()};
}

}  // namespace

std::vector<TiePoint> find_tie_points(const Reconstruction& before, const Reconstruction& after,
                                      const Sim3& t2_from_t1, int photos_per_epoch) {
  const std::vector<int> frames_t1 = select_keyframes(before.num_frames(), photos_per_epoch);
  const std::vector<int> frames_t2 = select_keyframes(after.num_frames(), photos_per_epoch);
  const std::vector<Photo> of_t1 = photos_of(before, frames_t1);
  const std::vector<Photo> of_t2 = photos_of(after, frames_t2);
  const auto pairs = overlapping_pairs(before, after, t2_from_t1, frames_t1, frames_t2);
  const auto radius_px = static_cast<float>(kSearchShare * before.width);
  const Sim3 t1_from_t2 = t2_from_t1.inverse();
  std::vector<std::vector<TiePoint>> found(pairs.size());
  parallel_for(static_cast<int64_t>(pairs.size()), 1, [&](int64_t begin, int64_t) {
    const auto [i, j] = pairs[static_cast<size_t>(begin)];
    const Photo &first = of_t1[i], &second = of_t2[j];
    const auto matches = match_descriptors_near(
        first.features, second.features,
        expected(first, t2_from_t1, after.views[static_cast<size_t>(second.frame)]),
        expected(second, t1_from_t2, before.views[static_cast<size_t>(first.frame)]), radius_px);
    for (const Match& match : matches) {
      const auto& a = first.lifted[static_cast<size_t>(match.first)];
      const auto& b = second.lifted[static_cast<size_t>(match.second)];
      if (!a || !b) continue;
      found[static_cast<size_t>(begin)].push_back(
          {first.frame, second.frame, a->x, b->x, a->covariance, b->covariance});
    }
  });
  std::vector<TiePoint> ties;
  for (const auto& of_pair : found) ties.insert(ties.end(), of_pair.begin(), of_pair.end());
  return ties;
}

}  // namespace vggtcd
