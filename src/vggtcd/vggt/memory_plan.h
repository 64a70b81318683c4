// SPDX-License-Identifier: Apache-2.0
// memory_plan: whether a forward pass fits into memory, asked before it starts.
#pragma once

#include <string>

#include "vggtcd/vggt/cost.h"

namespace vggtcd {

struct MemoryPlan {
  VggtRun run;
  int64_t needed = 0, available = 0;  // bytes
  int64_t frames_that_fit = 0;        // of this size and precision

  bool fits() const { return needed <= available; }
  std::string summary()
      const;  // "84 frames of 518 x 392 px, precision bf16: about 9.1 GB of memory"
};

// available: bytes that the pass may use (core/timer.h, available_memory_bytes).
MemoryPlan plan_memory(const VggtConfig& config, const VggtRun& run, int64_t available);

// Throws Error{kMemory} unless it fits; the message says what would.
void throw_unless_fits(const MemoryPlan& plan);

}  // namespace vggtcd
