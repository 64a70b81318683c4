// SPDX-License-Identifier: Apache-2.0
// The body of a thing in its photos: what erosion leaves of its pixels.
#include "vggtcd/change/thing_signs.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "vggtcd/scene/pixel_counts.h"
#include "vggtcd/scene/sky.h"

namespace vggtcd {
namespace {

constexpr int kAcross = 160;    // radius of the square that must fit in / the photo's width
constexpr float kStep = 0.05f;  // of the depth: another surface

// Of thing_probability, as bench/calibrate_things prints them.
constexpr double kConstant = -18.22, kPixelConfidence = 18.11, kSeenThrough = -5.75,
                 kCalledChanged = 2.28, kRootOfBody = 3.22, kLogPhotos = 1.16, kAtEdge = -1.91;

struct InPhoto {
  int64_t pixels = 0, body = 0, at_edge = 0;
};

class PhotoOfThing {
 public:
  PhotoOfThing(const Reconstruction& epoch, size_t frame)
      : width_(epoch.width),
        height_(epoch.height),
        radius_(std::max(1, epoch.width / kAcross)),
        depth_(epoch.frame_depth(static_cast<int>(frame))),
        sky_(epoch.frame_sky(static_cast<int>(frame))) {}

  // pixels: of this photo, ascending.
  InPhoto look(std::span<const size_t> pixels) const {
    int left = width_, right = -1;
    for (const size_t pixel : pixels) {
      left = std::min(left, column(pixel));
      right = std::max(right, column(pixel));
    }
    const int top = row(pixels.front()), bottom = row(pixels.back());
    // With a rim of nothing around, so that the border of the photo ends the thing too.
    const int width = right - left + 1 + 2 * radius_, height = bottom - top + 1 + 2 * radius_;
    const auto place = [&](size_t pixel) {
      return static_cast<size_t>(row(pixel) - top + radius_) * static_cast<size_t>(width) +
             static_cast<size_t>(column(pixel) - left + radius_);
    };
    std::vector<uint8_t> mask(static_cast<size_t>(width) * static_cast<size_t>(height), 0);
    for (const size_t pixel : pixels) mask[place(pixel)] = 1;
    const PixelCounts counts(mask, width, height);
    InPhoto result{static_cast<int64_t>(pixels.size()), 0, 0};
    for (const size_t pixel : pixels) {
      result.body += counts.all_around(place(pixel), radius_) ? 1 : 0;
      result.at_edge += at_edge(pixel) ? 1 : 0;
    }
    return result;
  }

 private:
  int column(size_t pixel) const { return static_cast<int>(pixel % static_cast<size_t>(width_)); }
  int row(size_t pixel) const { return static_cast<int>(pixel / static_cast<size_t>(width_)); }

  bool at_edge(size_t pixel) const {
    const int u = column(pixel), v = row(pixel);
    const float here = depth_[pixel];
    for (const auto& [du, dv] : {std::pair(-1, 0), {1, 0}, {0, -1}, {0, 1}}) {
      const int x = u + du * radius_, y = v + dv * radius_;
      if (x < 0 || y < 0 || x >= width_ || y >= height_) continue;
      const size_t other =
          static_cast<size_t>(y) * static_cast<size_t>(width_) + static_cast<size_t>(x);
      if (!sky_.empty() && sky_[other] != kNoSky) continue;
      if (!(std::abs(depth_[other] - here) <= kStep * here)) return true;
    }
    return false;
  }

  int width_, height_, radius_;
  std::span<const float> depth_;
  std::span<const uint8_t> sky_;
};

}  // namespace

void add_body(const Reconstruction& epoch, std::span<const uint32_t> members, ThingSigns& signs) {
  const size_t per_frame = epoch.pixels_per_frame();
  InPhoto sum;
  std::vector<size_t> pixels;
  for (size_t first = 0; first < members.size();) {
    const size_t frame = members[first] / per_frame;
    pixels.clear();
    size_t next = first;
    for (; next < members.size() && members[next] / per_frame == frame; ++next) {
      pixels.push_back(members[next] % per_frame);
    }
    first = next;
    const InPhoto seen = PhotoOfThing(epoch, frame).look(pixels);
    ++signs.photos;
    signs.photos_with_body += seen.body >= kMinBody ? 1 : 0;
    sum.pixels += seen.pixels;
    sum.body += seen.body;
    sum.at_edge += seen.at_edge;
  }
  const auto share = [&](int64_t part) {
    return static_cast<double>(part) / static_cast<double>(std::max<int64_t>(1, sum.pixels));
  };
  signs.body = share(sum.body);
  signs.at_edge = share(sum.at_edge);
}

double thing_probability(const ThingSigns& signs) {
  const double logit = kConstant + kPixelConfidence * signs.pixel_confidence +
                       kSeenThrough * signs.seen_through + kCalledChanged * signs.called_changed +
                       kRootOfBody * std::sqrt(signs.body) +
                       kLogPhotos * std::log2(std::max(1, signs.photos)) + kAtEdge * signs.at_edge;
  return 1 / (1 + std::exp(-logit));
}

}  // namespace vggtcd
