// SPDX-License-Identifier: Apache-2.0
// How well per-pixel change scores agree with labels: precision, recall, F1, average precision.
#pragma once

#include <cstdint>
#include <vector>

namespace vggtcd {

// Pixels that are evaluated: their score (higher: more changed), what they are called, and whether
// they truly changed.
struct ScoredPixels {
  std::vector<float> scores;
  std::vector<uint8_t> called, changed;

  void add(float score, bool called_changed, bool truly_changed) {
    scores.push_back(score);
    called.push_back(called_changed ? 1 : 0);
    changed.push_back(truly_changed ? 1 : 0);
  }
};

struct ChangeScores {
  int64_t pixels = 0, changed_pixels = 0;
  // Of what is called changed. 0 where the ratio is 0 / 0.
  double precision = 0, recall = 0, f1 = 0;
  // Share of the unchanged pixels that are called changed.
  double false_alarms = 0;
  // Average precision: sum over the distinct scores, from high to low, of the step in recall times
  // the precision there; pixels of one score come together. 0 if nothing changed.
  double auprc = 0;
  // The best F1 over all thresholds on the score (changed: above it), and that threshold: what
  // tuning on the answer would give.
  double best_f1 = 0;
  float best_threshold = 0;
};

ChangeScores evaluate_changes(const ScoredPixels& pixels);

}  // namespace vggtcd
