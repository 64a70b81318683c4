// SPDX-License-Identifier: Apache-2.0
// LevelScale: scores in 8 bits such that the page's threshold slider is exact.
#include "vggtcd/report/levels.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"

namespace vggtcd {

LevelScale::LevelScale(double threshold_u, double max_u) : threshold_u_(threshold_u) {
  check(threshold_u > 0 && std::isfinite(threshold_u), "LevelScale: positive threshold");
  const double reach = std::clamp(max_u / threshold_u, 2.0, 4.0);
  threshold_level_ = static_cast<int>(std::lround(kCount / reach));
  levels_per_u_ = threshold_level_ / threshold_u;
  for (int k = 0; k <= kCount; ++k) {
    const double edge = k == threshold_level_ ? threshold_u : threshold_u * k / threshold_level_;
    edges_[static_cast<size_t>(k)] = static_cast<float>(edge);
  }
}

uint8_t LevelScale::level(float score) const {
  if (std::isnan(score)) return kNoEvidence;
  // The guess is off by at most one, by rounding; the edges themselves decide.
  const double guess = std::ceil(std::clamp(score * levels_per_u_, 0.0, kCount + 1.0));
  int level = static_cast<int>(guess);
  while (level > 0 && !(score > edge(level - 1))) --level;
  while (level <= kCount && score > edge(level)) ++level;
  return static_cast<uint8_t>(level);
}

ScoreCounts count_scores(std::span<const float> scores, const LevelScale& scale) {
  constexpr int64_t kGrain = 1 << 16;
  const auto size = static_cast<int64_t>(scores.size());
  std::vector<std::array<int64_t, 256>> partial(static_cast<size_t>(num_chunks(size, kGrain)));
  parallel_for(size, kGrain, [&](int64_t begin, int64_t end) {
    auto& histogram = partial[static_cast<size_t>(begin / kGrain)];
    histogram.fill(0);
    for (int64_t i = begin; i < end; ++i) ++histogram[scale.level(scores[static_cast<size_t>(i)])];
  });
  ScoreCounts counts;
  std::array<int64_t, 256> total{};
  for (const auto& histogram : partial) {
    for (size_t level = 0; level < 256; ++level) total[level] += histogram[level];
  }
  int64_t above = total[LevelScale::kCount + 1];
  for (int k = LevelScale::kCount; k >= 0; --k) {
    counts.above[static_cast<size_t>(k)] = above;
    above += total[static_cast<size_t>(k)];
  }
  counts.pixels = above;
  return counts;
}

}  // namespace vggtcd
