// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/core/job_clock.h"

#include <gtest/gtest.h>

namespace vggtcd {
namespace {

const std::vector<PlannedStage> kPlan = {{"read", 10}, {"match", 100}, {"depth", 1000}};

TEST(JobClock, KnowsNothingOfAJobWithoutAPlan) {
  JobClock clock;
  clock.started("read", 0);
  clock.advanced(0.5);
  EXPECT_FALSE(clock.job_seconds_left(1).has_value());
  EXPECT_DOUBLE_EQ(*clock.stage_seconds_left(3), 3);
}

TEST(JobClock, StartsFromThePlan) {
  JobClock clock;
  clock.planned(kPlan);
  EXPECT_DOUBLE_EQ(*clock.job_seconds_left(0), 1110);
  clock.started("read", 5);
  EXPECT_DOUBLE_EQ(*clock.job_seconds_left(9), 1106);
  EXPECT_DOUBLE_EQ(*clock.job_seconds_left(50), 1100);  // overdue, but not negative
  EXPECT_FALSE(clock.stage_seconds_left(50).has_value());
}

TEST(JobClock, TheStagesOwnProgressSaysWhatIsLeftOfIt) {
  JobClock clock;
  clock.planned(kPlan);
  clock.started("read", 0);
  clock.advanced(0.25);
  EXPECT_DOUBLE_EQ(*clock.job_seconds_left(8), 24 + 1100);
}

TEST(JobClock, ASlowMachineMakesTheRestLonger) {
  JobClock clock;
  clock.planned(kPlan);
  clock.started("read", 0);
  clock.finished(10);
  clock.started("match", 10);
  clock.finished(510);  // five times as long as planned
  // 110 s were planned and 510 s were needed; 2 s of doubt on either side.
  EXPECT_DOUBLE_EQ(*clock.job_seconds_left(510), 1000 * 512.0 / 112.0);
}

TEST(JobClock, PassesOverWhatAnEarlierRunHasLeft) {
  JobClock clock;
  clock.planned(kPlan);
  clock.started("depth", 0);
  EXPECT_DOUBLE_EQ(*clock.job_seconds_left(0), 1000);
  clock.finished(1000);
  EXPECT_DOUBLE_EQ(*clock.job_seconds_left(1000), 0);
}

TEST(JobClock, AStageThatIsNotPlannedChangesNothing) {
  JobClock clock;
  clock.planned(kPlan);
  clock.started("tidy up", 0);
  clock.finished(500);
  EXPECT_DOUBLE_EQ(*clock.job_seconds_left(500), 1110);
}

TEST(JobClock, ANewPlanReplacesTheOldOneAndKeepsWhatIsKnownOfTheMachine) {
  JobClock clock;
  clock.planned({{"match", 98}});
  clock.started("match", 0);
  clock.finished(198);
  clock.planned({{"votes", 50}});
  EXPECT_DOUBLE_EQ(*clock.job_seconds_left(198), 100);
}

}  // namespace
}  // namespace vggtcd
