// SPDX-License-Identifier: Apache-2.0
// Running change detection as `detect` does, and counting.
#include "vggtcd/evaluation/change_benchmark.h"

#include <cmath>
#include <limits>

#include "vggtcd/change/free_space.h"
#include "vggtcd/change/instances.h"
#include "vggtcd/change/nearest_distance.h"
#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

constexpr float kLowest = -std::numeric_limits<float>::infinity();

double share(int64_t part, int64_t whole) {
  return whole > 0 ? static_cast<double>(part) / static_cast<double>(whole) : 0;
}

ChangeAnswer answer_of(const ChangeSet& changes, const EpochChange& epoch) {
  ChangeAnswer answer{epoch.score, {}};
  answer.called.resize(epoch.score.size());
  for (size_t pixel = 0; pixel < epoch.score.size(); ++pixel) {
    answer.called[pixel] = changes.changed(epoch, pixel) ? 1 : 0;
  }
  return answer;
}

// The labels decide, the gap in sigmas ranks; what nobody saw ranks last.
ChangeAnswer answer_of(const EpochChange& epoch, const std::vector<float>& rank) {
  ChangeAnswer answer{rank, {}};
  answer.called.resize(rank.size());
  for (size_t pixel = 0; pixel < rank.size(); ++pixel) {
    const ChangeLabel label = epoch.label[pixel];
    answer.called[pixel] = is_change(label) ? 1 : 0;
    if (label == ChangeLabel::kNoEvidence) {
      answer.score[pixel] = std::numeric_limits<float>::quiet_NaN();
    } else if (label == ChangeLabel::kUnobserved || std::isnan(rank[pixel])) {
      answer.score[pixel] = kLowest;
    }
  }
  return answer;
}

void score_all_ways(const SceneTruth& truth, const ChangeAnswer& t1, const ChangeAnswer& t2,
                    const std::string& method, const std::string& alignment,
                    ChangeBenchmark& result) {
  const std::vector<AnsweredEpoch> epochs = {{truth.of(Epoch::kT1), t1},
                                             {truth.of(Epoch::kT2), t2}};
  for (const bool every_pixel : {false, true}) {
    for (const bool unseen_counted : {false, true}) {
      ChangeOutcome outcome = score_changes(epochs, unseen_counted, every_pixel);
      outcome.method = method;
      outcome.alignment = alignment;
      result.changes.push_back(std::move(outcome));
    }
  }
}

// By object id: longest edge of the box / scene extent.
std::vector<double> object_sizes(const SyntheticScene& scene, double extent_m) {
  std::vector<double> sizes = {0};
  for (const SceneObject& object : scene.objects) {
    sizes.push_back(object.box_m().sizes().maxCoeff() / extent_m);
  }
  return sizes;
}

InstanceScores score_instances(const ChangeProblem& problem, const Sim3& t2_from_t1,
                               const ChangeSet& changes) {
  const ChangeInstances found =
      find_instances(problem.before, problem.after, t2_from_t1, changes, {});
  const auto pixels = [&](Epoch which, const std::vector<int32_t>& reported) {
    const EpochTruth& truth = problem.truth.of(which);
    return InstancePixels{reported, truth.object, truth.label, truth.other_looked};
  };
  const InstancePixels epochs[] = {pixels(Epoch::kT1, found.id_t1),
                                   pixels(Epoch::kT2, found.id_t2)};
  return evaluate_instances(epochs, object_sizes(problem.scene, problem.truth.extent_m));
}

}  // namespace

ChangeOutcome score_changes(const std::vector<AnsweredEpoch>& epochs, bool unseen_counted,
                            bool every_pixel) {
  ChangeOutcome outcome;
  outcome.unseen_counted = unseen_counted;
  outcome.every_pixel = every_pixel;
  ScoredPixels pixels;
  int64_t unseen = 0, unseen_called = 0, labelled = 0, with_evidence = 0, sky = 0, sky_called = 0;
  for (const auto& [truth, answer] : epochs) {
    check(answer.score.size() == truth.label.size() && answer.called.size() == truth.label.size(),
          "score_changes: an answer for every pixel");
    for (size_t pixel = 0; pixel < truth.label.size(); ++pixel) {
      const uint8_t label = truth.label[pixel];
      const bool evidence = !std::isnan(answer.score[pixel]);
      if (truth.object[pixel] == 0) {  // sky: nothing changes there, and saying nothing is right
        const bool called = evidence && answer.called[pixel] != 0;
        if (evidence) pixels.add(answer.score[pixel], called, false);
        ++sky;
        sky_called += called ? 1 : 0;
        continue;
      }
      if (label == kLabelVoid) continue;
      ++labelled;
      with_evidence += evidence ? 1 : 0;
      if (!evidence && !every_pixel) continue;
      const bool called = evidence && answer.called[pixel] != 0;
      if (!truth.other_looked[pixel]) {
        if (label == kLabelUnchanged) {
          ++unseen;
          unseen_called += called ? 1 : 0;
        }
        if (!unseen_counted) continue;
      }
      pixels.add(evidence ? answer.score[pixel] : kLowest, called, label == kLabelChanged);
    }
  }
  outcome.scores = evaluate_changes(pixels);
  outcome.unseen_called_changed = share(unseen_called, unseen);
  outcome.sky_called_changed = share(sky_called, sky);
  outcome.evidence = share(with_evidence, labelled);
  return outcome;
}

ChangeBenchmark benchmark_changes(const ChangeProblem& problem, const Sim3& t2_from_t1,
                                  const std::string& alignment, ProgressSink& progress) {
  const auto& [scene, truth, before, after] = problem;
  ChangeBenchmark result;
  ChangeSet changes = detect_changes(before, after, t2_from_t1, {});
  score_all_ways(truth, answer_of(changes, changes.t1), answer_of(changes, changes.t2), "distance",
                 alignment, result);
  result.instances.push_back(
      {"distance", alignment, score_instances(problem, t2_from_t1, changes)});
  std::vector<float> rank_t1(before.num_pixels()), rank_t2(after.num_pixels());
  const auto keep_evidence = [](std::vector<float>& rank) {
    return [&rank](int frame, const PhotoAnswers& answers) {
      std::ranges::copy(answers.evidence, rank.begin() + frame * std::ssize(answers.evidence));
    };
  };
  decide_by_labels(free_space_changes(before, after, t2_from_t1, {}, {}, progress, nullptr,
                                      {keep_evidence(rank_t1), keep_evidence(rank_t2)}),
                   changes);
  score_all_ways(truth, answer_of(changes.t1, rank_t1), answer_of(changes.t2, rank_t2), "votes",
                 alignment, result);
  result.instances.push_back({"votes", alignment, score_instances(problem, t2_from_t1, changes)});
  return result;
}

}  // namespace vggtcd
