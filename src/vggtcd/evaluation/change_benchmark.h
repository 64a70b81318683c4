// SPDX-License-Identifier: Apache-2.0
// Change detection methods against the labels of a generated scene.
#pragma once

#include <string>
#include <vector>

#include "vggtcd/core/progress.h"
#include "vggtcd/evaluation/change_metrics.h"
#include "vggtcd/evaluation/instance_metrics.h"
#include "vggtcd/evaluation/synthetic/render.h"
#include "vggtcd/geometry/sim3.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

// `unseen_counted`: pixels that the other epoch never saw are evaluated too. `every_pixel`: pixels
// without evidence (low confidence) count as called unchanged; else they are left out. A pixel of
// the sky is unchanged where a method says anything about it, and left out where it says nothing.
struct ChangeOutcome {
  std::string method;     // "distance": the paper's; "votes": free space
  std::string alignment;  // registration_methods() name
  bool unseen_counted = false, every_pixel = false;
  ChangeScores scores;
  double evidence = 0;  // share of the labelled pixels that carry evidence
  // Share of unchanged, never-seen pixels that are called changed.
  double unseen_called_changed = 0;
  double sky_called_changed = 0;  // share of the sky's pixels, with evidence or without
};

struct InstanceOutcome {
  std::string method, alignment;
  InstanceScores scores;
};

struct ChangeBenchmark {
  std::vector<ChangeOutcome> changes;
  std::vector<InstanceOutcome> instances;
};

// The passes that a scene's methods are given, and what is true.
struct ChangeProblem {
  const SyntheticScene& scene;
  const SceneTruth& truth;
  const Reconstruction& before;
  const Reconstruction& after;
};

// Both methods with one alignment: pixels in all four ways of counting, and changed things.
ChangeBenchmark benchmark_changes(const ChangeProblem& problem, const Sim3& t2_from_t1,
                                  const std::string& alignment, ProgressSink& progress);

// What a method says about the pixels of one epoch. The score ranks (higher: more changed); NaN: no
// evidence.
struct ChangeAnswer {
  std::vector<float> score;
  std::vector<uint8_t> called;  // 1: changed
};
struct AnsweredEpoch {
  const EpochTruth& truth;
  const ChangeAnswer& answer;
};
// One way of counting; the names of method and alignment are the caller's.
ChangeOutcome score_changes(const std::vector<AnsweredEpoch>& epochs, bool unseen_counted,
                            bool every_pixel);

}  // namespace vggtcd
