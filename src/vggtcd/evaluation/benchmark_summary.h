// SPDX-License-Identifier: Apache-2.0
// What the benchmark says over all scenes: one line per registration method, one per way of finding
// change.
#pragma once

#include <string>
#include <vector>

#include "vggtcd/evaluation/benchmark.h"

namespace vggtcd {

// The outcome of a method that has numbers, or null.
const MethodOutcome* find_outcome(const SceneOutcome& scene, const std::string& method);
// How a change detection method did where only surface that both epochs saw counts, of it the
// pixels with evidence; or null.
const ChangeOutcome* find_change(const SceneOutcome& scene, const std::string& method,
                                 const std::string& alignment);
// The smallest ATE of a scene; infinite if no method has one.
double best_ate(const SceneOutcome& scene);

// An ATE is above the floor if it is more than 10 % above what the best Sim(3) for the passes
// leaves: below that the passes decide, not the method.
bool above_floor(const SceneOutcome& scene, double ate);

struct MethodSummary {
  std::string method;
  int scenes = 0;       // with numbers; all means are over them
  int without = 0;      // without
  double ate_mean = 0;  // NaN if some scene has no numbers: such means do not compare
  double seconds_mean = 0;
  int first = 0;  // scenes with the smallest ATE of all methods; equal ones count for both
  // Against coarse only, over the scenes where both have numbers.
  double ate_to_coarse = 0;    // mean ATE / mean ATE
  int worse_than_coarse = 0;   // by more than rounding, 1e-9
  double worst_to_coarse = 0;  // largest ratio
  // Scenes where it has the smaller ATE though that is above the floor.
  int beats_paper = 0, beats_robust = 0;
};
// In the order of registration_methods(), those that any scene has.
std::vector<MethodSummary> summarise_methods(const std::vector<SceneOutcome>& scenes);

struct ChangeSummary {
  std::string method, alignment;
  bool unseen_counted = false, every_pixel = false;
  // Means over the scenes; those of precision to best_f1 over the scenes where something changed.
  int scenes = 0, changed_scenes = 0;
  double precision = 0, recall = 0, f1 = 0, auprc = 0, best_f1 = 0;
  double false_alarms = 0, unseen_called_changed = 0;
  double evidence = 0;  // share of the pixels that carry evidence
  int outdoor_scenes = 0;
  double sky_called_changed = 0;  // share of the sky, mean over the outdoor scenes
};
std::vector<ChangeSummary> summarise_changes(const std::vector<SceneOutcome>& scenes);

struct InstanceSummary {
  std::string method, alignment;
  InstanceScores total;
};
std::vector<InstanceSummary> summarise_instances(const std::vector<SceneOutcome>& scenes);

// Budgets where the fine stage made ATE worse than coarse (by more than rounding, 1e-9 of it).
struct MonotonicityCount {
  int violations = 0, cases = 0;
  double worst_ratio = 1;  // full / coarse
};
MonotonicityCount count_violations(const std::vector<SceneOutcome>& scenes);

}  // namespace vggtcd
