// SPDX-License-Identifier: Apache-2.0
// Means and counts over scenes.
#include "vggtcd/evaluation/benchmark_summary.h"

#include <algorithm>
#include <limits>

#include "vggtcd/evaluation/registration_methods.h"

namespace vggtcd {
namespace {

constexpr double kRounding = 1e-9;
constexpr double kFloorMargin = 1.1;

// Whether `outcome` is the better one where the difference is the method's doing.
bool beats(const SceneOutcome& scene, const MethodOutcome& outcome, const MethodOutcome* other) {
  return other != nullptr && outcome.errors.ate_mean < other->errors.ate_mean &&
         above_floor(scene, outcome.errors.ate_mean);
}

MethodSummary summarise(const std::string& method, const std::vector<SceneOutcome>& scenes) {
  MethodSummary summary;
  summary.method = method;
  double compared = 0, coarse_sum = 0;
  for (const SceneOutcome& scene : scenes) {
    const MethodOutcome* outcome = find_outcome(scene, method);
    if (outcome == nullptr) {
      ++summary.without;
      continue;
    }
    const double ate = outcome->errors.ate_mean;
    ++summary.scenes;
    summary.ate_mean += ate;
    summary.seconds_mean += outcome->seconds;
    summary.first += ate <= best_ate(scene) ? 1 : 0;
    summary.beats_paper += beats(scene, *outcome, find_outcome(scene, "paper")) ? 1 : 0;
    summary.beats_robust += beats(scene, *outcome, find_outcome(scene, "robust")) ? 1 : 0;
    if (const MethodOutcome* coarse = find_outcome(scene, "coarse")) {
      const double ratio = ate / coarse->errors.ate_mean;
      compared += ate;
      coarse_sum += coarse->errors.ate_mean;
      summary.worse_than_coarse += ratio > 1 + kRounding ? 1 : 0;
      summary.worst_to_coarse = std::max(summary.worst_to_coarse, ratio);
    }
  }
  summary.ate_mean = summary.without > 0 ? std::numeric_limits<double>::quiet_NaN()
                                         : summary.ate_mean / summary.scenes;
  summary.seconds_mean /= std::max(1, summary.scenes);
  summary.ate_to_coarse = coarse_sum > 0 ? compared / coarse_sum : 0;
  return summary;
}

}  // namespace

const MethodOutcome* find_outcome(const SceneOutcome& scene, const std::string& method) {
  for (const MethodOutcome& outcome : scene.methods) {
    if (outcome.method == method && outcome.failure.empty()) return &outcome;
  }
  return nullptr;
}

const ChangeOutcome* find_change(const SceneOutcome& scene, const std::string& method,
                                 const std::string& alignment) {
  for (const ChangeOutcome& c : scene.changes) {
    if (c.method == method && c.alignment == alignment && !c.unseen_counted && !c.every_pixel) {
      return &c;
    }
  }
  return nullptr;
}

double best_ate(const SceneOutcome& scene) {
  double best = std::numeric_limits<double>::infinity();
  for (const MethodOutcome& outcome : scene.methods) {
    if (outcome.failure.empty()) best = std::min(best, outcome.errors.ate_mean);
  }
  return best;
}

bool above_floor(const SceneOutcome& scene, double ate) {
  return ate > kFloorMargin * scene.best_fit_ate;
}

std::vector<MethodSummary> summarise_methods(const std::vector<SceneOutcome>& scenes) {
  std::vector<MethodSummary> summaries;
  for (const RegistrationMethod& method : registration_methods()) {
    MethodSummary summary = summarise(method.name, scenes);
    if (summary.scenes > 0) summaries.push_back(std::move(summary));
  }
  return summaries;
}

std::vector<ChangeSummary> summarise_changes(const std::vector<SceneOutcome>& scenes) {
  std::vector<ChangeSummary> summaries;
  const auto entry = [&](const ChangeOutcome& c) -> size_t {
    for (size_t k = 0; k < summaries.size(); ++k) {
      const ChangeSummary& s = summaries[k];
      if (s.method == c.method && s.alignment == c.alignment &&
          s.unseen_counted == c.unseen_counted && s.every_pixel == c.every_pixel) {
        return k;
      }
    }
    ChangeSummary summary;
    summary.method = c.method;
    summary.alignment = c.alignment;
    summary.unseen_counted = c.unseen_counted;
    summary.every_pixel = c.every_pixel;
    summaries.push_back(std::move(summary));
    return summaries.size() - 1;
  };
  for (const SceneOutcome& scene : scenes) {
    for (const ChangeOutcome& c : scene.changes) {
      ChangeSummary& s = summaries[entry(c)];
      ++s.scenes;
      s.false_alarms += c.scores.false_alarms;
      s.unseen_called_changed += c.unseen_called_changed;
      s.evidence += c.evidence;
      s.outdoor_scenes += scene.outdoor ? 1 : 0;
      s.sky_called_changed += c.sky_called_changed;
      if (c.scores.changed_pixels == 0) continue;
      ++s.changed_scenes;
      s.precision += c.scores.precision;
      s.recall += c.scores.recall;
      s.f1 += c.scores.f1;
      s.auprc += c.scores.auprc;
      s.best_f1 += c.scores.best_f1;
    }
  }
  for (ChangeSummary& s : summaries) {
    for (double* mean : {&s.false_alarms, &s.unseen_called_changed, &s.evidence}) *mean /= s.scenes;
    s.sky_called_changed /= std::max(1, s.outdoor_scenes);
    for (double* mean : {&s.precision, &s.recall, &s.f1, &s.auprc, &s.best_f1}) {
      *mean /= std::max(1, s.changed_scenes);
    }
  }
  return summaries;
}

std::vector<InstanceSummary> summarise_instances(const std::vector<SceneOutcome>& scenes) {
  std::vector<InstanceSummary> summaries;
  for (const SceneOutcome& scene : scenes) {
    for (const InstanceOutcome& outcome : scene.instances) {
      auto found = std::find_if(summaries.begin(), summaries.end(), [&](const auto& summary) {
        return summary.method == outcome.method && summary.alignment == outcome.alignment;
      });
      if (found == summaries.end()) {
        found = summaries.insert(found, {outcome.method, outcome.alignment, {}});
      }
      found->total += outcome.scores;
    }
  }
  return summaries;
}

MonotonicityCount count_violations(const std::vector<SceneOutcome>& scenes) {
  MonotonicityCount count;
  for (const SceneOutcome& scene : scenes) {
    for (const AblationOutcome& outcome : scene.ablation) {
      ++count.cases;
      const double ratio = outcome.full_ate / outcome.coarse_ate;
      if (ratio > 1 + kRounding) ++count.violations;
      count.worst_ratio = std::max(count.worst_ratio, ratio);
    }
  }
  return count;
}

}  // namespace vggtcd
