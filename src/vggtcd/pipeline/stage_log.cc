// SPDX-License-Identifier: Apache-2.0
// StageLog: runs the numbered stages of a job, reports them and remembers what each one cost.
#include "vggtcd/pipeline/stage_log.h"

#include "vggtcd/core/interrupt.h"
#include "vggtcd/core/timer.h"

namespace vggtcd {

void StageLog::run(const std::string& name, const std::function<void(ProgressStage&)>& work) {
  throw_if_interrupted();
  double seconds = 0;
  {
    ProgressStage stage(progress_, name);
    work(stage);
    seconds = stage.seconds();
  }
  records_.push_back({name, seconds, peak_memory_bytes()});
}

}  // namespace vggtcd
