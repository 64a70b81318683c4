// SPDX-License-Identifier: Apache-2.0
// CameraHead: camera tokens -> pose encodings, refined over a few iterations; upstream
// vggt.heads.camera_head.CameraHead.
#pragma once

#include <array>
#include <vector>

#include "vggtcd/vggt/aggregator.h"

namespace vggtcd {

// Translation x, y, z; quaternion x, y, z, w; vertical and horizontal field of view in radians.
using PoseEncoding = std::array<float, 9>;

class CameraHead {
 public:
  // scope: camera_head.
  CameraHead(const WeightScope& scope, const VggtConfig& config);

  // One per frame, after the activations: the fields of view are clamped at 0.
  std::vector<PoseEncoding> forward(const AggregatedTokens& tokens, const Trace& trace) const;

 private:
  void modulate(int64_t frames, const Rows& pose_tokens, const Rows& embedded, const Rows& x) const;

  int64_t channels_;
  int iterations_;
  PoseEncoding empty_pose_;
  LayerNorm token_norm_, trunk_norm_;
  Linear embed_pose_, modulation_;
  std::vector<Block> trunk_;
  Linear branch_fc1_, branch_fc2_;
};

}  // namespace vggtcd
