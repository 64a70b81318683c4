// SPDX-License-Identifier: Apache-2.0
// What a forward pass costs: floating-point operations per stage and memory, from sizes alone, for
// memory plans, time left and benchmarks.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "vggtcd/vggt/config.h"
#include "vggtcd/vggt/precision.h"

namespace vggtcd {

// The stages of a forward pass, in order.
enum class VggtStage { kPatchEmbed, kFrameAttention, kGlobalAttention, kCameras, kDepth, kPoints };
inline constexpr size_t kNumVggtStages = 6;
std::string_view stage_name(VggtStage stage);

// Floating-point operations of products, attention and convolutions: two per multiplication and
// addition. Element-wise work is not counted.
struct VggtCost {
  std::array<double, kNumVggtStages> flop{};
  double attention_flop = 0;  // of all stages together: softmax(q k^T) v
  double total_flop() const;
  double flop_of(VggtStage stage) const { return flop[static_cast<size_t>(stage)]; }
};

struct VggtRun {
  int64_t frames = 0, height = 0, width = 0;  // px, multiples of the patch size
  Precision precision = Precision::kF32;      // resolved
  bool depth_head = true, point_head = false;
};

VggtCost cost_of(const VggtConfig& config, const VggtRun& run);

// Bytes: the packed weights, and the most that a pass has beside them at any moment, its input and
// results included.
struct VggtMemory {
  int64_t weights = 0, activations = 0;
  int64_t total() const { return weights + activations; }
};
VggtMemory memory_of(const VggtConfig& config, const VggtRun& run);

}  // namespace vggtcd
