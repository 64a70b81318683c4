// SPDX-License-Identifier: Apache-2.0
// JobClock: the time left of a whole job, from a plan of its stages and from how fast those done
// were.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "vggtcd/core/progress.h"

namespace vggtcd {

// What is left of the stage at hand follows from its own progress once there is some; the stages
// after it take what was planned, times how much slower than planned this machine was so far. All
// times are given by the caller, in seconds of one clock.
class JobClock {
 public:
  void planned(const std::vector<PlannedStage>& stages);
  void started(std::string_view stage, double now_s);
  void advanced(double fraction) { fraction_ = fraction; }
  void finished(double now_s);

  // Of the stage at hand; nothing before it has reported any progress.
  std::optional<double> stage_seconds_left(double now_s) const;
  // Of the whole job; nothing without a plan.
  std::optional<double> job_seconds_left(double now_s) const;

 private:
  double slowness() const;

  std::vector<PlannedStage> stages_;
  size_t next_ = 0;                // the first stage that has not started
  std::optional<size_t> at_hand_;  // the stage that runs, if it is in the plan
  bool running_ = false;
  double started_s_ = 0, fraction_ = 0;
  double planned_done_s_ = 0, really_done_s_ = 0;  // of stages in a plan
};

}  // namespace vggtcd
