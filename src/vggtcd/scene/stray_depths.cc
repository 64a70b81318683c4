// SPDX-License-Identifier: Apache-2.0
// Depths so far from all others that they are no surface of the scene.
#include "vggtcd/scene/stray_depths.h"

#include <algorithm>
#include <vector>

#include "vggtcd/geometry/order_statistics.h"

namespace vggtcd {
namespace {

constexpr double kLowPercent = 1, kHighPercent = 99;
constexpr double kBeyond = 100;     // times the percentile
constexpr double kAloneBeyond = 5;  // the same of a pixel with no like beside it
constexpr float kAlike = 2;         // at most this ratio

// The percentiles of the depths that are there. Pixels without depth are 0, the smallest, so
// percentiles of the others are percentiles of all: no copy is needed.
std::vector<double> ordinary_range(const std::vector<float>& depth, size_t without) {
  const auto percent_of_all = [&](double percent) {
    const auto last = static_cast<double>(depth.size() - 1);
    const double place =
        static_cast<double>(without) + percent / 100 * (last - static_cast<double>(without));
    return last > 0 ? std::min(100.0, 100 * place / last) : 0;
  };
  const double percents[] = {percent_of_all(kLowPercent), percent_of_all(kHighPercent)};
  return percentiles(depth, percents);
}

bool is_alone(const Reconstruction& r, size_t pixel) {
  const size_t in_frame = pixel % r.pixels_per_frame();
  const int u = static_cast<int>(in_frame % static_cast<size_t>(r.width));
  const int v = static_cast<int>(in_frame / static_cast<size_t>(r.width));
  const float depth = r.depth[pixel];
  for (int y = std::max(0, v - 1); y <= std::min(r.height - 1, v + 1); ++y) {
    for (int x = std::max(0, u - 1); x <= std::min(r.width - 1, u + 1); ++x) {
      if (x == u && y == v) continue;
      const float other =
          r.depth[pixel - in_frame + static_cast<size_t>(y) * static_cast<size_t>(r.width) +
                  static_cast<size_t>(x)];
      if (other > depth / kAlike && other < depth * kAlike) return false;
    }
  }
  return true;
}

}  // namespace

StrayDepths drop_stray_depths(Reconstruction& reconstruction) {
  StrayDepths strays;
  std::vector<float>& depth = reconstruction.depth;
  const auto without = static_cast<size_t>(std::ranges::count(depth, 0.0f));
  if (without == depth.size()) return strays;
  const std::vector<double> range = ordinary_range(depth, without);
  strays.nearest = range[0];
  strays.farthest = range[1];
  std::vector<size_t> dropped;  // only then, for neighbours are looked at
  for (size_t pixel = 0; pixel < depth.size(); ++pixel) {
    const auto d = static_cast<double>(depth[pixel]);
    if (d == 0) continue;
    const double beyond = std::max(d / strays.farthest, strays.nearest / d);
    if (!(beyond > kAloneBeyond)) continue;
    if (!(beyond > kBeyond) && !is_alone(reconstruction, pixel)) continue;
    (d > strays.farthest ? strays.too_far : strays.too_near) += 1;
    dropped.push_back(pixel);
  }
  for (const size_t pixel : dropped) depth[pixel] = 0;
  return strays;
}

}  // namespace vggtcd
