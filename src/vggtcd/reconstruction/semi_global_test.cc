// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/reconstruction/semi_global.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace vggtcd {
namespace {

// The recursion of the paper, one direction after the other, in plain loops over pixels that start
// where the direction enters the image.
std::vector<int> by_definition(const std::vector<uint8_t>& costs, int width, int height, int planes,
                               const std::vector<float>& gray, const SemiGlobalOptions& options) {
  std::vector<int> sums(costs.size(), 0);
  const auto at = [&](int x, int y, int d) {
    return static_cast<size_t>((y * width + x) * planes + d);
  };
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      if (dx == 0 && dy == 0) continue;
      std::vector<int> path(costs.size(), -1);
      bool advanced = true;
      while (advanced) {  // until every pixel whose predecessor is known has its value
        advanced = false;
        for (int y = 0; y < height; ++y) {
          for (int x = 0; x < width; ++x) {
            if (path[at(x, y, 0)] >= 0) continue;
            const int px = x - dx, py = y - dy;
            const bool inside = px >= 0 && py >= 0 && px < width && py < height;
            if (inside && path[at(px, py, 0)] < 0) continue;
            advanced = true;
            for (int d = 0; d < planes; ++d) {
              int value = costs[at(x, y, d)];
              if (inside) {
                const float edge = std::abs(gray[at(x, y, 0) / static_cast<size_t>(planes)] -
                                            gray[at(px, py, 0) / static_cast<size_t>(planes)]) /
                                   8;
                const int large = std::max(options.large_step_min,
                                           static_cast<int>(static_cast<float>(options.large_step) /
                                                            std::max(1.0f, edge)));
                int smallest = path[at(px, py, 0)];
                for (int k = 1; k < planes; ++k) smallest = std::min(smallest, path[at(px, py, k)]);
                int best = std::min(path[at(px, py, d)], smallest + large);
                if (d > 0) best = std::min(best, path[at(px, py, d - 1)] + options.small_step);
                if (d + 1 < planes)
                  best = std::min(best, path[at(px, py, d + 1)] + options.small_step);
                value += best - smallest;
              }
              path[at(x, y, d)] = value;
            }
          }
        }
      }
      for (size_t i = 0; i < sums.size(); ++i) sums[i] += path[i];
    }
  }
  return sums;
}

TEST(AggregateSemiGlobal, EqualsTheRecursionOnRandomCosts) {
  std::mt19937 random(7);
  constexpr int kWidth = 9, kHeight = 6, kPlanes = 16;
  std::vector<uint8_t> costs(kWidth * kHeight * kPlanes);
  for (uint8_t& cost : costs) cost = static_cast<uint8_t>(random() % 128);
  std::vector<float> gray(kWidth * kHeight);
  for (float& value : gray) value = static_cast<float>(random() % 256);
  const SemiGlobalOptions options;
  const auto found = aggregate_semi_global(costs, kWidth, kHeight, kPlanes, gray, options);
  const auto expected = by_definition(costs, kWidth, kHeight, kPlanes, gray, options);
  ASSERT_EQ(found.size(), expected.size());
  for (size_t i = 0; i < found.size(); ++i) ASSERT_EQ(found[i], expected[i]) << i;
}

}  // namespace
}  // namespace vggtcd
