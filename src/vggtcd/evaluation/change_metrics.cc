// SPDX-License-Identifier: Apache-2.0
// Precision, recall and what follows from them, in one pass over sorted scores.
#include "vggtcd/evaluation/change_metrics.h"

#include <algorithm>
#include <limits>
#include <numeric>

#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

double ratio(int64_t part, int64_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0.0;
}

double f1_of(double precision, double recall) {
  return precision + recall > 0 ? 2 * precision * recall / (precision + recall) : 0.0;
}

void evaluate_decisions(const ScoredPixels& pixels, ChangeScores& result) {
  int64_t called = 0, right = 0;
  for (size_t k = 0; k < pixels.called.size(); ++k) {
    called += pixels.called[k];
    right += pixels.called[k] & pixels.changed[k];
  }
  result.precision = ratio(right, called);
  result.recall = ratio(right, result.changed_pixels);
  result.f1 = f1_of(result.precision, result.recall);
  result.false_alarms = ratio(called - right, result.pixels - result.changed_pixels);
}

void evaluate_ranking(const ScoredPixels& pixels, ChangeScores& result) {
  std::vector<uint32_t> order(pixels.scores.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(), [&](uint32_t a, uint32_t b) {
    return pixels.scores[a] > pixels.scores[b] || (pixels.scores[a] == pixels.scores[b] && a < b);
  });
  int64_t called = 0, right = 0;
  double recall_before = 0;
  for (size_t k = 0; k < order.size(); ++k) {
    const float score = pixels.scores[order[k]];
    ++called;
    right += pixels.changed[order[k]];
    const bool last = k + 1 == order.size();
    if (!last && pixels.scores[order[k + 1]] == score) continue;  // ties come together
    const double precision = ratio(right, called), recall = ratio(right, result.changed_pixels);
    result.auprc += (recall - recall_before) * precision;
    recall_before = recall;
    if (f1_of(precision, recall) > result.best_f1) {
      result.best_f1 = f1_of(precision, recall);
      result.best_threshold =
          last ? -std::numeric_limits<float>::infinity() : pixels.scores[order[k + 1]];
    }
  }
}

}  // namespace

ChangeScores evaluate_changes(const ScoredPixels& pixels) {
  check(
      pixels.scores.size() == pixels.changed.size() && pixels.scores.size() == pixels.called.size(),
      "evaluate_changes: a score, a call and a label per pixel");
  ChangeScores result;
  result.pixels = static_cast<int64_t>(pixels.scores.size());
  result.changed_pixels = std::accumulate(pixels.changed.begin(), pixels.changed.end(), int64_t{0});
  evaluate_decisions(pixels, result);
  evaluate_ranking(pixels, result);
  return result;
}

}  // namespace vggtcd
