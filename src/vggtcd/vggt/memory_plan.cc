// SPDX-License-Identifier: Apache-2.0
// memory_plan: the cost model against what is free.
#include "vggtcd/vggt/memory_plan.h"

#include <fmt/format.h>

#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

// Beside weights and activations: the program, its libraries, the allocator's leftovers.
constexpr int64_t kProgramBytes = 100'000'000;

int64_t bytes_for(const VggtConfig& config, VggtRun run, int64_t frames) {
  run.frames = frames;
  return memory_of(config, run).total() + kProgramBytes;
}

double gigabytes(int64_t bytes) { return static_cast<double>(bytes) / 1e9; }

}  // namespace

std::string MemoryPlan::summary() const {
  return fmt::format("{} {} of {} x {} px, precision {}: about {:.1f} GB of memory", run.frames,
                     run.frames == 1 ? "frame" : "frames", run.width, run.height,
                     enum_to_string(run.precision), gigabytes(needed));
}

MemoryPlan plan_memory(const VggtConfig& config, const VggtRun& run, int64_t available) {
  MemoryPlan plan{run, bytes_for(config, run, run.frames), available};
  // The need grows with the frames; the largest number that fits lies in [fit, too_many).
  int64_t fit = 0, too_many = run.frames + 1;
  while (too_many - fit > 1) {
    const int64_t middle = fit + (too_many - fit) / 2;
    (bytes_for(config, run, middle) <= available ? fit : too_many) = middle;
  }
  plan.frames_that_fit = fit;
  return plan;
}

void throw_unless_fits(const MemoryPlan& plan) {
  if (plan.fits()) return;
  const std::string remedy = plan.frames_that_fit > 0
                                 ? fmt::format("{} frames would fit", plan.frames_that_fit)
                                 : "not even one frame fits";
  throw_error(ErrorCode::kMemory, "{}, but {:.1f} GB are free; {}{}", plan.summary(),
              gigabytes(plan.available), remedy,
              plan.run.precision == Precision::kF32 && bf16_weights_are_supported()
                  ? "; --precision bf16_weights halves the weights"
                  : "");
}

}  // namespace vggtcd
