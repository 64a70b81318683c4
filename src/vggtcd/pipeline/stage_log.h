// SPDX-License-Identifier: Apache-2.0
// StageLog: runs the numbered stages of a job, reports them and remembers what each one cost.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "vggtcd/core/progress.h"

namespace vggtcd {

struct StageRecord {
  std::string name;
  double seconds = 0;
  int64_t peak_memory_bytes = 0;  // of the process, up to the end of this stage
};

class StageLog {
 public:
  explicit StageLog(ProgressSink& progress) : progress_(progress) {}

  // Runs the work as one reported stage.
  void run(const std::string& name, const std::function<void(ProgressStage&)>& work);

  const std::vector<StageRecord>& records() const { return records_; }
  ProgressSink& progress() { return progress_; }

 private:
  ProgressSink& progress_;
  std::vector<StageRecord> records_;
};

}  // namespace vggtcd
