// SPDX-License-Identifier: Apache-2.0
// LevelScale: scores in 8 bits such that the page's threshold slider is exact: its positions are
// the edges between levels, and the result's own threshold is one of them.
#pragma once

#include <array>
#include <cstdint>
#include <span>

namespace vggtcd {

class LevelScale {
 public:
  static constexpr int kCount = 250;  // edges are numbered 0 .. kCount
  static constexpr uint8_t kNoEvidence = 255;

  // Edges k * threshold_u / threshold_level in float, edge threshold_level being the threshold
  // itself as ChangeSet compares it. The scale reaches to about max_u, at least to twice and at
  // most to four times the threshold. Throws Error{kInternal} unless threshold_u > 0.
  LevelScale(double threshold_u, double max_u);

  int threshold_level() const { return threshold_level_; }
  double threshold_u() const { return threshold_u_; }
  float edge(int k) const { return edges_[static_cast<size_t>(k)]; }

  // The number of edges below the score, 0 .. kCount + 1: score > edge(k) exactly if level > k. NaN
  // (no evidence) gives kNoEvidence.
  uint8_t level(float score) const;

 private:
  double threshold_u_;
  int threshold_level_;
  double levels_per_u_;
  std::array<float, kCount + 1> edges_;
};

// How many scores are numbers, and for every edge how many are above it.
struct ScoreCounts {
  int64_t pixels = 0;
  std::array<int64_t, LevelScale::kCount + 1> above{};
};
ScoreCounts count_scores(std::span<const float> scores, const LevelScale& scale);

}  // namespace vggtcd
