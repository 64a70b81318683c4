// SPDX-License-Identifier: Apache-2.0
// What detect() will do and how long each stage takes, from sizes alone: for --dry-run and for the
// time left of a job.
#include "vggtcd/pipeline/job_plan.h"

#include <fmt/format.h>

#include <algorithm>

#include "vggtcd/core/parallel.h"

namespace vggtcd {
namespace {

// Microseconds per pixel of both epochs, measured on a Zen 5 server with 84 + 84 frames of
// 518 x 392 px; those of stages that use all threads are of one thread.
constexpr double kReadUs = 0.03, kCompareUs = 0.08, kAlignUs = 0.03, kRobustUs = 0.15;
constexpr double kPlausibilityUs = 0.005;  // a sample of them
constexpr double kVotesUs = 0.66, kThingsUs = 0.02;
constexpr double kWriteUs = 0.12, kOverlaysUs = 0.2, kPageUs = 0.3;
constexpr double kEveryStageS = 0.02;

constexpr double kBytesPerPixel = 20, kVotesBytesPerPixel = 4, kFixedBytes = 1e8;

}  // namespace

std::vector<PlannedStage> plan_detect(const JobSize& size, const DetectOptions& options,
                                      bool votes) {
  std::vector<PlannedStage> stages;
  const auto add = [&](const char* stage, double us_per_pixel, bool parallel) {
    const double threads = parallel ? num_threads() : 1;
    stages.push_back({stage, kEveryStageS + 1e-6 * us_per_pixel * size.pixels() / threads});
  };
  add("read predictions", kReadUs, false);
  add("coarse alignment", kAlignUs, true);
  const AlignmentMethod method = resolve_method(options.alignment.method, size.initial);
  if (method != AlignmentMethod::kCoarse) add("fine alignment", kAlignUs, true);
  if (method == AlignmentMethod::kRobust) add("robust alignment", kRobustUs, true);
  add("plausibility", kPlausibilityUs, true);
  add("change detection", kCompareUs, true);
  if (votes) add("free-space votes", kVotesUs, true);
  add("changed things", kThingsUs, false);
  add("write results", kWriteUs + (options.overlays ? kOverlaysUs : 0), false);
  if (options.page) add("report page", kPageUs, false);
  return stages;
}

int64_t detect_memory_bytes(const JobSize& size, bool votes) {
  const double per_pixel = kBytesPerPixel + (votes ? kVotesBytesPerPixel : 0);
  return static_cast<int64_t>(kFixedBytes + per_pixel * size.pixels());
}

double total_seconds(const std::vector<PlannedStage>& stages) {
  double total = 0;
  for (const PlannedStage& stage : stages) total += stage.seconds;
  return total;
}

std::string rough_duration(double seconds) {
  if (seconds < 90) return fmt::format("{:.0f} s", std::max(1.0, seconds));
  if (seconds < 5400) return fmt::format("{:.0f} min", seconds / 60);
  return fmt::format("{:.1f} h", seconds / 3600);
}

}  // namespace vggtcd
