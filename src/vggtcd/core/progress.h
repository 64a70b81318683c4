// SPDX-License-Identifier: Apache-2.0
// Progress: libraries report stages and shares of work done; the command line decides how to show
// it.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace vggtcd {

// A stage that is still to come, and how long it is expected to take.
struct PlannedStage {
  std::string stage;
  double seconds = 0;
};

// Receives progress. All calls come from the thread that called the library.
class ProgressSink {
 public:
  virtual ~ProgressSink() = default;
  virtual void stage_started(std::string_view stage) = 0;
  // 0 <= fraction <= 1, non-decreasing within a stage.
  virtual void stage_advanced(std::string_view stage, double fraction) = 0;
  virtual void stage_finished(std::string_view stage, double seconds) = 0;
  // Something the user should know but that stops nothing, e.g. a frame that was skipped.
  virtual void notice(std::string_view message) = 0;
  // The stages from here to the end of the job, in order; a later call replaces it. A stage whose
  // result an earlier run has left may be passed over.
  virtual void job_planned(const std::vector<PlannedStage>&) {}
};

// A sink that drops everything; what a library uses when it is given none.
ProgressSink& silent_progress();

// Reports one stage: started on construction, finished on destruction (not when unwinding).
class ProgressStage {
 public:
  ProgressStage(ProgressSink& sink, std::string name);
  ~ProgressStage();
  ProgressStage(const ProgressStage&) = delete;
  ProgressStage& operator=(const ProgressStage&) = delete;
  void advance(double fraction);
  double seconds() const;

 private:
  ProgressSink& sink_;
  std::string name_;
  double started_s_;
  double fraction_ = 0;
  int exceptions_;
};

}  // namespace vggtcd
