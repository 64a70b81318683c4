// SPDX-License-Identifier: Apache-2.0
// What a photo of the other epoch says about a point: the windows of its depths.
#include "vggtcd/change/witness.h"

#include <algorithm>
#include <limits>

#include "vggtcd/core/parallel.h"
#include "vggtcd/scene/pixel_counts.h"
#include "vggtcd/scene/sky.h"

namespace vggtcd {
namespace {

// The sky testifies this far from everything else only, of the photo's width: where a roof ends the
// poses of two photos need not agree to the pixel.
constexpr int kOpenMarginSteps = 40;

void mark_open_sky(const Reconstruction& epoch, int frame, std::span<uint8_t> extremes) {
  const std::span<const uint8_t> sky = epoch.frame_sky(frame);
  std::vector<uint8_t> open(sky.size());
  std::ranges::transform(sky, open.begin(), [](uint8_t s) { return s == kOpenSky ? 1 : 0; });
  const PixelCounts counts(open, epoch.width, epoch.height);
  const int margin = std::max(1, epoch.width / kOpenMarginSteps);
  for (size_t i = 0; i < open.size(); ++i) {
    if (open[i] != 0 && counts.all_around(i, margin)) extremes[i] = kOpenWindow;
  }
}

}  // namespace

Witness make_witness(const Reconstruction& epoch, const Sim3& t2_from_epoch, float min_confidence,
                     double open_gap_u) {
  Witness witness{&epoch,
                  static_cast<float>(t2_from_epoch.scale),
                  static_cast<float>(open_gap_u),
                  WindowSteps(epoch.width),
                  {},
                  std::vector<uint8_t>(epoch.num_pixels(), kNoExtremes),
                  {}};
  for (const View& view : epoch.views) {
    witness.camera_from_t2.push_back(camera_from_new_world(view.camera_from_world, t2_from_epoch));
  }
  const int height = epoch.height, width = epoch.width;
  parallel_for(epoch.num_frames(), 1, [&](int64_t frame, int64_t) {
    const size_t first = static_cast<size_t>(frame) * epoch.pixels_per_frame();
    for (int v = 0; v < height; ++v) {
      for (int u = 0; u < width; ++u) {
        float lo = std::numeric_limits<float>::max(), hi = 0;
        int nearest = 0, farthest = 0;
        for (int y = std::max(0, v - 1); y <= std::min(height - 1, v + 1); ++y) {
          for (int x = std::max(0, u - 1); x <= std::min(width - 1, u + 1); ++x) {
            const size_t i = first + static_cast<size_t>(y) * static_cast<size_t>(width) +
                             static_cast<size_t>(x);
            if (!testifies(epoch, i, min_confidence)) continue;
            const int in_window = 3 * (y - v + 1) + (x - u + 1);
            if (epoch.depth[i] < lo) lo = epoch.depth[i], nearest = in_window;
            if (epoch.depth[i] > hi) hi = epoch.depth[i], farthest = in_window;
          }
        }
        const size_t i =
            first + static_cast<size_t>(v) * static_cast<size_t>(width) + static_cast<size_t>(u);
        if (hi > 0) witness.extremes[i] = static_cast<uint8_t>(nearest | farthest << 4);
      }
    }
    if (!epoch.sky.empty()) {
      mark_open_sky(epoch, static_cast<int>(frame),
                    std::span(witness.extremes).subspan(first, epoch.pixels_per_frame()));
    }
  });
  return witness;
}

std::span<const EnumName<Vote>> enum_names(Vote) {
  static constexpr EnumName<Vote> kNames[] = {{Vote::kLooksThrough, "looks_through"},
                                              {Vote::kSees, "sees"},
                                              {Vote::kHidden, "hidden"},
                                              {Vote::kOutside, "outside"},
                                              {Vote::kNoTestimony, "no_testimony"}};
  return kNames;
}

}  // namespace vggtcd
