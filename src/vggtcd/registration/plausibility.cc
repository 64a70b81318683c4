// SPDX-License-Identifier: Apache-2.0
// Whether an alignment can be believed at all.
#include "vggtcd/registration/plausibility.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "vggtcd/core/parallel.h"
#include "vggtcd/scene/confidence.h"
#include "vggtcd/scene/point_cloud.h"
#include "vggtcd/scene/view_overlap.h"

namespace vggtcd {
namespace {

constexpr int kSamplesAcross = 16;      // along each side of a photo
constexpr int kMaxPhotos = 8;           // of the other epoch, asked about a photo
constexpr double kLeastConfident = 10;  // percent of the pixels that are not looked at
constexpr double kMinSeenShare = 0.05;  // in the better direction; below: no overlap
constexpr int64_t kMinPairs = 100;      // fewer: no overlap either
constexpr double kRefuseAboveChance = 0.2;
constexpr double kDoubtAboveChance = 0.33;
constexpr double kCertainAgreement = 0.5;  // a wall has one depth, so chance is no measure there
constexpr double kRefuseUnexplained = 0.08;
constexpr double kDoubtUnexplained = 0.04;

struct SamplePixel {
  int u, v;
  float depth;
};

// Those with depth that are confident enough.
std::vector<SamplePixel> sample_pixels(const Reconstruction& r, int frame, float min_confidence) {
  const auto depth = r.frame_depth(frame), confidence = r.frame_confidence(frame);
  std::vector<SamplePixel> pixels;
  for (int row = 0; row < kSamplesAcross; ++row) {
    for (int column = 0; column < kSamplesAcross; ++column) {
      const int u = (2 * column + 1) * r.width / (2 * kSamplesAcross);
      const int v = (2 * row + 1) * r.height / (2 * kSamplesAcross);
      const size_t i =
          static_cast<size_t>(v) * static_cast<size_t>(r.width) + static_cast<size_t>(u);
      if (depth[i] > 0 && confidence[i] >= min_confidence) pixels.push_back({u, v, depth[i]});
    }
  }
  return pixels;
}

bool same_depth(double found, double expected) {
  return std::abs(found - expected) < kSameDepth * expected;
}

struct Counts {
  int64_t points = 0, seen = 0, pairs = 0, agreeing = 0;
  double by_chance = 0;
  void operator+=(const Counts& other) {
    points += other.points;
    seen += other.seen;
    pairs += other.pairs;
    agreeing += other.agreeing;
    by_chance += other.by_chance;
  }
};

// A photo of the other epoch: its depths, and a sample of them in ascending order.
struct OtherPhoto {
  const View* view;
  std::span<const float> depth;
  std::vector<float> sample;

  // The share of the photo that is this deep.
  double share_at(double z) const {
    const auto low = std::ranges::upper_bound(sample, static_cast<float>((1 - kSameDepth) * z));
    const auto high = std::ranges::lower_bound(sample, static_cast<float>((1 + kSameDepth) * z));
    return sample.empty() ? 0
                          : static_cast<double>(std::max<int64_t>(0, high - low)) /
                                static_cast<double>(sample.size());
  }
};

std::vector<OtherPhoto> other_photos(const Reconstruction& r, float min_confidence) {
  std::vector<OtherPhoto> photos;
  for (int frame = 0; frame < r.num_frames(); ++frame) {
    OtherPhoto photo{&r.views[static_cast<size_t>(frame)], r.frame_depth(frame), {}};
    for (const SamplePixel& pixel : sample_pixels(r, frame, min_confidence)) {
      photo.sample.push_back(pixel.depth);
    }
    std::ranges::sort(photo.sample);
    photos.push_back(std::move(photo));
  }
  return photos;
}

// Asks one photo about one point in its world; false: the point is outside.
bool ask(const OtherPhoto& photo, const Eigen::Vector3d& x, Counts& counts) {
  const Eigen::Vector3d in_camera = photo.view->camera_from_world * x;
  if (!(in_camera.z() > 0)) return false;
  const Eigen::Vector2d uv = photo.view->pinhole.project(in_camera);
  const int width = photo.view->pinhole.width, height = photo.view->pinhole.height;
  const double u = std::floor(uv.x() + 0.5), v = std::floor(uv.y() + 0.5);
  if (!(u >= 0 && v >= 0 && u < width && v < height)) return false;
  const double found = static_cast<double>(
      photo.depth[static_cast<size_t>(v) * static_cast<size_t>(width) + static_cast<size_t>(u)]);
  if (!(found > 0)) return true;
  ++counts.pairs;
  counts.agreeing += same_depth(found, in_camera.z()) ? 1 : 0;
  counts.by_chance += photo.share_at(in_camera.z());
  return true;
}

Counts ask_about(const Reconstruction& epoch, const Reconstruction& other,
                 const Sim3& other_from_epoch) {
  const float min_confidence = confidence_percentile(epoch, kLeastConfident);
  const std::vector<OtherPhoto> photos =
      other_photos(other, confidence_percentile(other, kLeastConfident));
  const auto views = overlapping_views(epoch, other, other_from_epoch, kMaxPhotos);
  std::vector<Counts> counts(views.size());
  parallel_for(epoch.num_frames(), 1, [&](int64_t frame, int64_t) {
    const size_t i = static_cast<size_t>(frame);
    const PixelRays rays(epoch.views[i], other_from_epoch);
    for (const SamplePixel& pixel : sample_pixels(epoch, static_cast<int>(frame), min_confidence)) {
      const Eigen::Vector3d x = rays.point(pixel.u, pixel.v, pixel.depth).cast<double>();
      bool seen = false;
      for (const int j : views[i]) seen |= ask(photos[static_cast<size_t>(j)], x, counts[i]);
      ++counts[i].points;
      counts[i].seen += seen ? 1 : 0;
    }
  });
  Counts sum;
  for (const Counts& of_frame : counts) sum += of_frame;
  return sum;
}

double share(double part, int64_t whole) {
  return whole > 0 ? part / static_cast<double>(whole) : 0;
}

std::string describe_surfaces(const SurfaceAgreement& surfaces) {
  return fmt::format(
      "{:.0f} % of the points inside the other epoch's photos are at its depth within {:.0f} %, "
      "by chance {:.0f} %",
      100 * surfaces.agreeing, 100 * kSameDepth, 100 * surfaces.by_chance);
}

}  // namespace

double SurfaceAgreement::above_chance() const {
  return by_chance < 1 ? (agreeing - by_chance) / (1 - by_chance) : agreeing;
}

SurfaceAgreement surface_agreement(const Reconstruction& before, const Reconstruction& after,
                                   const Sim3& t2_from_t1) {
  const Counts t1 = ask_about(before, after, t2_from_t1);
  const Counts t2 = ask_about(after, before, t2_from_t1.inverse());
  SurfaceAgreement surfaces;
  surfaces.seen_share_t1 = share(static_cast<double>(t1.seen), t1.points);
  surfaces.seen_share_t2 = share(static_cast<double>(t2.seen), t2.points);
  surfaces.pairs = t1.pairs + t2.pairs;
  surfaces.agreeing = share(static_cast<double>(t1.agreeing + t2.agreeing), surfaces.pairs);
  surfaces.by_chance = share(t1.by_chance + t2.by_chance, surfaces.pairs);
  return surfaces;
}

std::span<const EnumName<Plausibility>> enum_names(Plausibility) {
  static constexpr EnumName<Plausibility> kNames[] = {
      {Plausibility::kBelievable, "believable"},
      {Plausibility::kDoubtful, "doubtful"},
      {Plausibility::kNoOverlap, "no_overlap"},
      {Plausibility::kSurfacesDisagree, "surfaces_disagree"},
      {Plausibility::kJointDisagrees, "joint_disagrees"}};
  return kNames;
}

PlausibilityResult judge_plausibility(const SurfaceAgreement& surfaces,
                                      const std::optional<CoarseResult>& coarse,
                                      std::span<const std::string> doubts) {
  PlausibilityResult result;
  result.surfaces = surfaces;
  double unexplained = 0;
  if (coarse) {
    result.joint_unexplained_t1 = coarse->t1.unexplained_share;
    result.joint_unexplained_t2 = coarse->t2.unexplained_share;
    unexplained = std::max(coarse->t1.unexplained_share, coarse->t2.unexplained_share);
  }
  const double seen = std::max(surfaces.seen_share_t1, surfaces.seen_share_t2);
  const bool certain = surfaces.agreeing >= kCertainAgreement;
  const auto decide = [&](Plausibility verdict, std::string explanation) {
    result.verdict = verdict;
    result.explanation = std::move(explanation);
    return result;
  };
  if (unexplained > kRefuseUnexplained) {
    return decide(
        Plausibility::kJointDisagrees,
        fmt::format(
            "the joint pass does not fit its keyframes of the {} epoch: the best similarity "
            "leaves {:.0f} % of their variance unexplained, where a good one leaves 2 %",
            unexplained == coarse->t1.unexplained_share ? "before" : "after", 100 * unexplained));
  }
  if (seen < kMinSeenShare || surfaces.pairs < kMinPairs) {
    return decide(
        Plausibility::kNoOverlap,
        fmt::format("no overlap between the epochs: {:.1f} % of the before epoch's points "
                    "are inside a photo of the after epoch, {:.1f} % the other way",
                    100 * surfaces.seen_share_t1, 100 * surfaces.seen_share_t2));
  }
  if (surfaces.above_chance() < kRefuseAboveChance && !certain) {
    return decide(Plausibility::kSurfacesDisagree,
                  "the epochs' surfaces do not agree: " + describe_surfaces(surfaces));
  }
  if ((surfaces.above_chance() < kDoubtAboveChance && !certain) ||
      unexplained > kDoubtUnexplained || !doubts.empty()) {
    std::string why = describe_surfaces(surfaces);
    for (const std::string& doubt : doubts) why += "; " + doubt;
    if (unexplained > kDoubtUnexplained) {
      why += fmt::format("; the joint pass leaves {:.0f} % of its points' variance unexplained",
                         100 * unexplained);
    }
    return decide(Plausibility::kDoubtful, "the alignment is doubtful: " + why);
  }
  return decide(Plausibility::kBelievable,
                "the epochs fit together: " + describe_surfaces(surfaces));
}

}  // namespace vggtcd
