// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/core/progress.h"

#include <gmock/gmock.h>

#include <stdexcept>
#include <vector>

namespace vggtcd {
namespace {

struct Recorder : ProgressSink {
  void stage_started(std::string_view stage) override {
    log.push_back("start " + std::string(stage));
  }
  void stage_advanced(std::string_view, double fraction) override { fractions.push_back(fraction); }
  void stage_finished(std::string_view stage, double) override {
    log.push_back("finish " + std::string(stage));
  }
  void notice(std::string_view) override {}
  std::vector<std::string> log;
  std::vector<double> fractions;
};

TEST(ProgressStage, ReportsStartAndFinish) {
  Recorder recorder;
  { const ProgressStage stage(recorder, "align"); }
  EXPECT_THAT(recorder.log, testing::ElementsAre("start align", "finish align"));
}

TEST(ProgressStage, NeverGoesBackwardsOrOutOfRange) {
  Recorder recorder;
  ProgressStage stage(recorder, "align");
  for (const double fraction : {-1.0, 0.5, 0.2, 3.0}) stage.advance(fraction);
  EXPECT_THAT(recorder.fractions, testing::ElementsAre(0.0, 0.5, 0.5, 1.0));
}

TEST(ProgressStage, AFailedStageIsNotReportedAsFinished) {
  Recorder recorder;
  try {
    const ProgressStage stage(recorder, "align");
    throw std::runtime_error("no");
  } catch (const std::runtime_error&) {
  }
  EXPECT_THAT(recorder.log, testing::ElementsAre("start align"));
}

}  // namespace
}  // namespace vggtcd
