// SPDX-License-Identifier: Apache-2.0
// What detect() will do and how long each stage takes, from sizes alone: for --dry-run and for the
// time left of a job.
#pragma once

#include <cstdint>
#include <vector>

#include "vggtcd/core/progress.h"
#include "vggtcd/pipeline/detect.h"

namespace vggtcd {

struct JobSize {
  int frames_before = 0, frames_after = 0;
  int width = 0, height = 0;  // px, of a frame
  InitialSource initial = InitialSource::kOwnJointPass;
  double pixels() const {
    return static_cast<double>(frames_before + frames_after) * width * height;
  }
};

// The stages of detect() in order, by the names that it reports, at rates measured on a Zen 5
// server. `votes`: free space decides (decides_by_votes).
std::vector<PlannedStage> plan_detect(const JobSize& size, const DetectOptions& options,
                                      bool votes);

// Estimated peak of detect(), bytes.
int64_t detect_memory_bytes(const JobSize& size, bool votes);

double total_seconds(const std::vector<PlannedStage>& stages);

// "90 s", "12 min"
std::string rough_duration(double seconds);

}  // namespace vggtcd
