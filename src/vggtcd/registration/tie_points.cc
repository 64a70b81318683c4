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
#include "vggtcd/scene/frame_image.h"
#include "vggtcd/scene/keyframes.h"
#include "vggtcd/scene/view_overlap.h"

namespace vggtcd {
namespace {

constexpr int kMaxKeyPoints = 500;  // of a photo
constexpr int kMaxSide_px = 320;    // photos are shrunk to it: they err more than key points do
// Chosen by each photo, of the other epoch and of its own; a pair may be chosen by both.
constexpr int kPairsPerPhoto = 4, kPairsWithinEpoch = 2;
constexpr size_t kMinTiesOfPair = 6;    // of two photos
constexpr double kSearchShare = 0.08;   // of the photo's width: how far off a key point may be
constexpr double kMinConfidence = 15;   // percentile
constexpr float kMaxDepthStep = 0.06f;  // within 3 x 3 pixels, of the depth: another surface
constexpr double kKeyPointSigma_px = 0.7;
constexpr double kDepthSigma = 0.05;  // of the depth; ties go by what is seen, not by it

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
  for (const int frame : frames) images.push_back(frame_image(r, frame));
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

// One epoch's chosen photos.
struct ChosenPhotos {
  const Reconstruction& reconstruction;
  bool is_t1;
  std::vector<int> frames;
  std::vector<Photo> photos;
};

ChosenPhotos choose_photos(const Reconstruction& r, bool is_t1, int photos_per_epoch) {
  const std::vector<int> frames = select_keyframes(r.num_frames(), photos_per_epoch);
  return {r, is_t1, frames, photos_of(r, frames)};
}

using Pairs = std::set<std::pair<size_t, size_t>>;  // of positions in ChosenPhotos

// Of each photo of `from` the photos of `to` that overlap it most, without itself.
void add_overlapping(const ChosenPhotos& from, const ChosenPhotos& to, const Sim3& to_from_from,
                     int per_photo, Pairs& pairs) {
  const auto best = overlapping_views(from.reconstruction, to.reconstruction, to_from_from,
                                      to.reconstruction.num_frames());
  for (size_t i = 0; i < from.frames.size(); ++i) {
    int taken = 0;
    for (const int other : best[static_cast<size_t>(from.frames[i])]) {
      const auto found = std::lower_bound(to.frames.begin(), to.frames.end(), other);
      if (found == to.frames.end() || *found != other) continue;
      const auto j = static_cast<size_t>(found - to.frames.begin());
      if (from.is_t1 == to.is_t1 && i == j) continue;
      const bool in_order = from.is_t1 == to.is_t1 ? i < j : from.is_t1;
      pairs.insert(in_order ? std::pair(i, j) : std::pair(j, i));
      if (++taken == per_photo) break;
    }
  }
}

void append_ties(const ChosenPhotos& first, const ChosenPhotos& second,
                 const Sim3& second_from_first, const Pairs& chosen, std::vector<TiePoint>& ties) {
  const std::vector<std::pair<size_t, size_t>> pairs(chosen.begin(), chosen.end());
  const int width = std::max(first.reconstruction.width, second.reconstruction.width);
  const auto radius_px = static_cast<float>(kSearchShare * width);
  const Sim3 first_from_second = second_from_first.inverse();
  const auto view_of = [](const ChosenPhotos& epoch, const Photo& photo) -> const View& {
    return epoch.reconstruction.views[static_cast<size_t>(photo.frame)];
  };
  std::vector<std::vector<TiePoint>> found(pairs.size());
  parallel_for(static_cast<int64_t>(pairs.size()), 1, [&](int64_t begin, int64_t) {
    const auto [i, j] = pairs[static_cast<size_t>(begin)];
    const Photo &a = first.photos[i], &b = second.photos[j];
    std::vector<TiePoint>& of_pair = found[static_cast<size_t>(begin)];
    for (const Match& match : match_descriptors_near(
             a.features, b.features, expected(a, second_from_first, view_of(second, b)),
             expected(b, first_from_second, view_of(first, a)), radius_px)) {
      const auto& in_a = a.lifted[static_cast<size_t>(match.first)];
      const auto& in_b = b.lifted[static_cast<size_t>(match.second)];
      if (!in_a || !in_b) continue;
      of_pair.push_back({{first.is_t1, a.frame},
                         {second.is_t1, b.frame},
                         in_a->x,
                         in_b->x,
                         in_a->covariance,
                         in_b->covariance});
    }
    if (of_pair.size() < kMinTiesOfPair) of_pair.clear();
  });
  for (const auto& of_pair : found) ties.insert(ties.end(), of_pair.begin(), of_pair.end());
}

}  // namespace

std::vector<TiePoint> find_tie_points(const Reconstruction& before, const Reconstruction& after,
                                      const Sim3& t2_from_t1, int photos_per_epoch) {
  const ChosenPhotos t1 = choose_photos(before, true, photos_per_epoch);
  const ChosenPhotos t2 = choose_photos(after, false, photos_per_epoch);
  Pairs across, within_t1, within_t2;
  add_overlapping(t1, t2, t2_from_t1, kPairsPerPhoto, across);
  add_overlapping(t2, t1, t2_from_t1.inverse(), kPairsPerPhoto, across);
  add_overlapping(t1, t1, {}, kPairsWithinEpoch, within_t1);
  add_overlapping(t2, t2, {}, kPairsWithinEpoch, within_t2);
  std::vector<TiePoint> ties;
  append_ties(t1, t2, t2_from_t1, across, ties);
  append_ties(t1, t1, {}, within_t1, ties);
  append_ties(t2, t2, {}, within_t2, ties);
  return ties;
}

}  // namespace vggtcd
