// SPDX-License-Identifier: Apache-2.0
// Finding the sky: confidence at its floor, far away, in one piece.
#include "vggtcd/scene/sky.h"

#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "vggtcd/core/parallel.h"
#include "vggtcd/geometry/order_statistics.h"
#include "vggtcd/scene/confidence.h"
#include "vggtcd/scene/pixel_counts.h"
#include "vggtcd/scene/pixel_patch.h"

namespace vggtcd {
namespace {

constexpr float kFloor = 1;             // of the confidences of a network
constexpr float kBelowFloor = 1e-3f;    // rounding of half precision
constexpr double kTypicalPercent = 75;  // of the confidences: much may be sky
constexpr double kShareOfTypical = 0.1;
constexpr double kMostAboveFloor = 0.2;
constexpr double kFarPercent = 90, kBeyondPercent = 99;  // of the depths of confident surface
constexpr int kAcross = 130;        // twice the radius of what must fit into a sky / the width
constexpr double kMinArea = 0.005;  // of the photo
constexpr size_t kMinSurface = 50;  // pixels, to know how far away a photo's surfaces are
constexpr double kMajority = 0.6;   // of the pixels around that has depth

// Above it a pixel shows a surface; nothing where confidences say nothing about sky.
std::optional<float> confidence_limit(const Reconstruction& r) {
  bool any = false;
  for (size_t pixel = 0; pixel < r.num_pixels(); ++pixel) {
    if (!(r.depth[pixel] > 0)) continue;
    if (r.confidence[pixel] < kFloor - kBelowFloor) return {};
    any = true;
  }
  if (!any) return {};
  const double above =
      static_cast<double>(confidence_percentile(r, kTypicalPercent)) - static_cast<double>(kFloor);
  if (!(above > 0)) return {};
  return kFloor + static_cast<float>(std::min(kShareOfTypical * above, kMostAboveFloor));
}

// One photo; all maps are [H, W].
class SkyOfPhoto {
 public:
  SkyOfPhoto(const Reconstruction& r, int frame, float limit)
      : width_(r.width),
        height_(r.height),
        depth_(r.frame_depth(frame)),
        confidence_(r.frame_confidence(frame)),
        limit_(limit),
        radius_(std::max(1, r.width / kAcross)) {}

  // Empty: none.
  std::vector<uint8_t> find() {
    std::vector<float> surface;
    for (size_t i = 0; i < depth_.size(); ++i) {
      if (depth_[i] > 0 && confidence_[i] > limit_) surface.push_back(depth_[i]);
    }
    std::array<double, 2> range = {0, 0};
    if (surface.size() >= kMinSurface) {
      const double percents[] = {kFarPercent, kBeyondPercent};
      const std::vector<double> found = percentiles(surface, percents);
      range = {found[0], found[1]};
    }
    std::vector<uint8_t> candidate(depth_.size());
    for (size_t i = 0; i < depth_.size(); ++i) {
      candidate[i] = far(i, range[0]) && confidence_[i] <= limit_ ? 1 : 0;
    }
    std::vector<uint8_t> sky = large_areas(candidate);
    if (sky.empty()) return sky;
    follow_majority(range[0], sky);
    for (size_t i = 0; i < sky.size(); ++i) {
      if (sky[i] != 0) sky[i] = far(i, range[1]) ? kOpenSky : kSky;
    }
    return sky;
  }

 private:
  bool far(size_t i, double than) const {
    return depth_[i] > 0 && static_cast<double>(depth_[i]) > than;
  }

  // The candidates that are connected to a square full of them, in areas that are large enough.
  std::vector<uint8_t> large_areas(const std::vector<uint8_t>& candidate) const {
    const PixelCounts counts(candidate, width_, height_);
    std::vector<uint8_t> visited(candidate.size(), 0), sky(candidate.size(), 0);
    std::vector<size_t> area;
    bool any = false;
    for (size_t seed = 0; seed < candidate.size(); ++seed) {
      if (visited[seed] != 0 || candidate[seed] == 0 || !counts.all_around(seed, radius_)) continue;
      grow_patch(seed, width_, height_, visited, area,
                 [&](size_t, size_t pixel) { return candidate[pixel] != 0; });
      if (static_cast<double>(area.size()) < kMinArea * static_cast<double>(candidate.size())) {
        continue;
      }
      for (const size_t i : area) sky[i] = 1;
      any = true;
    }
    return any ? sky : std::vector<uint8_t>();
  }

  // Confidence is noisy: what is far away and mostly surrounded by sky is sky.
  void follow_majority(double than, std::vector<uint8_t>& sky) const {
    const PixelCounts counts(sky, width_, height_);
    for (size_t i = 0; i < sky.size(); ++i) {
      if (sky[i] == 0 && far(i, than) && counts.share_around(i, radius_) >= kMajority) sky[i] = 1;
    }
  }

  int width_, height_;
  std::span<const float> depth_, confidence_;
  float limit_;
  int radius_;
};

}  // namespace

size_t remove_sky(Reconstruction& r) {
  const std::optional<float> limit = confidence_limit(r);
  std::vector<std::vector<uint8_t>> found(r.views.size());
  if (limit) {
    parallel_for(r.num_frames(), 1, [&](int64_t frame, int64_t) {
      found[static_cast<size_t>(frame)] = SkyOfPhoto(r, static_cast<int>(frame), *limit).find();
    });
  }
  size_t pixels = 0;
  r.sky.clear();
  for (size_t frame = 0; frame < found.size(); ++frame) {
    if (found[frame].empty()) continue;
    r.sky.resize(r.num_pixels(), kNoSky);
    const size_t first = frame * r.pixels_per_frame();
    for (size_t i = 0; i < found[frame].size(); ++i) {
      if (found[frame][i] == kNoSky) continue;
      r.sky[first + i] = found[frame][i];
      r.depth[first + i] = 0;
      ++pixels;
    }
  }
  return pixels;
}

double sky_share(const Reconstruction& r) {
  const auto pixels = std::ranges::count_if(r.sky, [](uint8_t sky) { return sky != kNoSky; });
  return static_cast<double>(pixels) / static_cast<double>(r.num_pixels());
}

}  // namespace vggtcd
