// SPDX-License-Identifier: Apache-2.0
// Means and counts against outcomes made by hand.
#include "vggtcd/evaluation/benchmark_summary.h"

#include <gtest/gtest.h>

#include <cmath>

namespace vggtcd {
namespace {

MethodOutcome outcome(const std::string& method, double ate) {
  MethodOutcome result;
  result.method = method;
  result.errors.ate_mean = ate;
  result.seconds = 2;
  return result;
}

SceneOutcome scene(double floor, std::vector<MethodOutcome> methods) {
  SceneOutcome result;
  result.best_fit_ate = floor;
  result.methods = std::move(methods);
  return result;
}

MethodSummary summary_of(const std::vector<SceneOutcome>& scenes, const std::string& method) {
  for (const MethodSummary& summary : summarise_methods(scenes)) {
    if (summary.method == method) return summary;
  }
  ADD_FAILURE() << "no summary of " << method;
  return {};
}

TEST(SummariseMethods, CountsWinsAndWhatIsWorseThanCoarse) {
  const std::vector<SceneOutcome> scenes = {
      scene(0.5, {outcome("coarse", 1.0), outcome("paper", 1.2), outcome("robust", 0.8)}),
      scene(0.5, {outcome("coarse", 2.0), outcome("paper", 2.0), outcome("robust", 1.0)}),
      scene(0.5, {outcome("coarse", 1.0), outcome("paper", 0.7), outcome("robust", 0.9)})};
  const MethodSummary paper = summary_of(scenes, "paper");
  EXPECT_DOUBLE_EQ(paper.ate_mean, 3.9 / 3);
  EXPECT_DOUBLE_EQ(paper.ate_to_coarse, 3.9 / 4);
  EXPECT_EQ(paper.worse_than_coarse, 1);
  EXPECT_DOUBLE_EQ(paper.worst_to_coarse, 1.2);
  EXPECT_EQ(paper.first, 1);
  EXPECT_EQ(paper.beats_robust, 1);
  EXPECT_DOUBLE_EQ(paper.seconds_mean, 2);
  const MethodSummary robust = summary_of(scenes, "robust");
  EXPECT_EQ(robust.first, 2);
  EXPECT_EQ(robust.beats_paper, 2);
  EXPECT_EQ(robust.worse_than_coarse, 0);
}

TEST(SummariseMethods, AWinNearTheFloorBeatsNobody) {
  const std::vector<SceneOutcome> scenes = {
      scene(1.0, {outcome("scale_icp", 1.09), outcome("robust", 1.3)}),
      scene(1.0, {outcome("scale_icp", 1.11), outcome("robust", 1.3)})};
  EXPECT_EQ(summary_of(scenes, "scale_icp").beats_robust, 1);
  EXPECT_EQ(summary_of(scenes, "scale_icp").first, 2);
}

TEST(SummariseMethods, HasNoMeanWhereAnAnswerIsMissing) {
  MethodOutcome failed = outcome("fgr", 0);
  failed.failure = "no answer";
  const std::vector<SceneOutcome> scenes = {
      scene(0.5, {outcome("fgr", 3.0), outcome("coarse", 1.0)}),
      scene(0.5, {failed, outcome("coarse", 4.0)})};
  const MethodSummary fgr = summary_of(scenes, "fgr");
  EXPECT_EQ(fgr.without, 1);
  EXPECT_TRUE(std::isnan(fgr.ate_mean));
  EXPECT_DOUBLE_EQ(fgr.ate_to_coarse, 3.0);  // where both have an answer
}

ChangeOutcome change(double f1, int64_t changed_pixels, double false_alarms) {
  ChangeOutcome result;
  result.method = "votes";
  result.alignment = "paper";
  result.scores.f1 = f1;
  result.scores.changed_pixels = changed_pixels;
  result.scores.false_alarms = false_alarms;
  return result;
}

TEST(SummariseChanges, AveragesF1OnlyWhereSomethingChanged) {
  std::vector<SceneOutcome> scenes(3);
  scenes[0].changes = {change(0.8, 10, 0.1)};
  scenes[1].changes = {change(0.6, 10, 0.2)};
  scenes[2].changes = {change(0.0, 0, 0.6)};
  const auto summaries = summarise_changes(scenes);
  ASSERT_EQ(summaries.size(), 1u);
  EXPECT_DOUBLE_EQ(summaries[0].f1, 0.7);
  EXPECT_DOUBLE_EQ(summaries[0].false_alarms, 0.3);
  EXPECT_EQ(summaries[0].changed_scenes, 2);
}

TEST(SummariseInstances, AddsUpByMethodAndAlignment) {
  InstanceOutcome paper, robust;
  paper.method = robust.method = "votes";
  paper.alignment = "paper";
  robust.alignment = "robust";
  paper.scores.objects = 4;
  paper.scores.found = 3;
  robust.scores.objects = 4;
  std::vector<SceneOutcome> scenes(2);
  scenes[0].instances = scenes[1].instances = {paper, robust};
  const auto summaries = summarise_instances(scenes);
  ASSERT_EQ(summaries.size(), 2u);
  EXPECT_EQ(summaries[0].alignment, "paper");
  EXPECT_EQ(summaries[0].total.objects, 8);
  EXPECT_DOUBLE_EQ(summaries[0].total.recall(), 0.75);
}

TEST(CountViolations, CountsOnlyRealOnes) {
  SceneOutcome scene;
  scene.ablation = {{2, 1.0, 0.9, ""}, {3, 1.0, 1.0, ""}, {5, 1.0, 1.2, ""}, {0, 2.0, 2.1, ""}};
  const MonotonicityCount count = count_violations({scene});
  EXPECT_EQ(count.violations, 2);
  EXPECT_EQ(count.cases, 4);
  EXPECT_DOUBLE_EQ(count.worst_ratio, 1.2);
}

TEST(ParseSeeds, ReadsListsAndRanges) {
  EXPECT_EQ(parse_seeds("7"), std::vector<uint64_t>{7});
  EXPECT_EQ(parse_seeds("1,5,201-203"), (std::vector<uint64_t>{1, 5, 201, 202, 203}));
  for (const char* wrong : {"", "a", "1,", "3-1", "-1", "1-", "1 2", "0-99999"}) {
    EXPECT_THROW(parse_seeds(wrong), Error) << wrong;
  }
}

}  // namespace
}  // namespace vggtcd
