// SPDX-License-Identifier: Apache-2.0
// Precision, recall, F1 and average precision against counting by hand and brute force.
#include "vggtcd/evaluation/change_metrics.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "vggtcd/evaluation/synthetic/random.h"

namespace vggtcd {
namespace {

// Called changed: score > threshold.
ScoredPixels pixels(const std::vector<std::pair<float, int>>& list, float threshold) {
  ScoredPixels result;
  for (const auto& [score, changed] : list) result.add(score, score > threshold, changed != 0);
  return result;
}

TEST(EvaluateChanges, CountsByHand) {
  // Above 0.5: 3 pixels, 2 of them changed; 3 changed in all.
  const ChangeScores s =
      evaluate_changes(pixels({{0.9f, 1}, {0.8f, 0}, {0.7f, 1}, {0.5f, 1}, {0.1f, 0}}, 0.5f));
  EXPECT_DOUBLE_EQ(s.precision, 2.0 / 3);
  EXPECT_DOUBLE_EQ(s.recall, 2.0 / 3);
  EXPECT_DOUBLE_EQ(s.f1, 2.0 / 3);
  EXPECT_DOUBLE_EQ(s.false_alarms, 1.0 / 2);
  // Steps in recall at 0.9 (1/1), 0.7 (2/3), 0.5 (3/4), a third each.
  EXPECT_DOUBLE_EQ(s.auprc, (1.0 + 2.0 / 3 + 3.0 / 4) / 3);
  // Best: all down to 0.5, precision 3/4, recall 1; the threshold is the next score below.
  EXPECT_DOUBLE_EQ(s.best_f1, 2 * 0.75 / 1.75);
  EXPECT_FLOAT_EQ(s.best_threshold, 0.1f);
}

TEST(EvaluateChanges, AgreesWithBruteForceOverThresholdsWithTies) {
  Random random(9);
  std::vector<std::pair<float, int>> drawn;
  for (int k = 0; k < 400; ++k) {
    const float score = static_cast<float>(random.below(25));
    drawn.emplace_back(score, random.uniform() < 0.1 + 0.03 * static_cast<double>(score));
  }
  const ScoredPixels list = pixels(drawn, 0);
  const auto at = [&](float threshold) {
    double called = 0, right = 0, changed = 0;
    for (size_t k = 0; k < list.scores.size(); ++k) {
      changed += list.changed[k];
      called += list.scores[k] > threshold;
      right += list.scores[k] > threshold && list.changed[k];
    }
    const double precision = called > 0 ? right / called : 0, recall = right / changed;
    return std::array<double, 3>{
        precision, recall,
        precision + recall > 0 ? 2 * precision * recall / (precision + recall) : 0};
  };
  const std::set<float, std::greater<>> distinct(list.scores.begin(), list.scores.end());
  double auprc = 0, recall_before = 0, best = 0;
  for (const float score : distinct) {
    const auto [precision, recall, f1] = at(score - 0.5f);
    auprc += (recall - recall_before) * precision;
    recall_before = recall;
    best = std::max(best, f1);
  }
  for (const float threshold : {-1.0f, 0.0f, 7.0f, 7.5f, 23.0f, 24.0f, 99.0f}) {
    const ChangeScores s = evaluate_changes(pixels(drawn, threshold));
    const auto [precision, recall, f1] = at(threshold);
    EXPECT_DOUBLE_EQ(s.precision, precision) << threshold;
    EXPECT_DOUBLE_EQ(s.recall, recall) << threshold;
    EXPECT_DOUBLE_EQ(s.f1, f1) << threshold;
    EXPECT_NEAR(s.auprc, auprc, 1e-12);
    EXPECT_DOUBLE_EQ(s.best_f1, best);
    EXPECT_DOUBLE_EQ(at(s.best_threshold)[2], best);
  }
}

TEST(EvaluateChanges, IsZeroWhereNothingIsThere) {
  const ChangeScores none = evaluate_changes({});
  EXPECT_EQ(none.f1, 0);
  EXPECT_EQ(none.auprc, 0);
  const ChangeScores nothing_changed = evaluate_changes(pixels({{0.9f, 0}, {0.1f, 0}}, 0.5f));
  EXPECT_EQ(nothing_changed.precision, 0);
  EXPECT_EQ(nothing_changed.recall, 0);
  EXPECT_EQ(nothing_changed.auprc, 0);
  EXPECT_EQ(nothing_changed.false_alarms, 0.5);
}

TEST(EvaluateChanges, TakesDecisionsThatAreNotAThresholdOnTheScore) {
  ScoredPixels list;
  list.add(0.1f, true, true);
  list.add(0.9f, false, true);
  list.add(0.5f, false, false);
  const ChangeScores s = evaluate_changes(list);
  EXPECT_DOUBLE_EQ(s.precision, 1);
  EXPECT_DOUBLE_EQ(s.recall, 0.5);
  EXPECT_DOUBLE_EQ(s.auprc, (1.0 + 2.0 / 3) / 2);
}

}  // namespace
}  // namespace vggtcd
