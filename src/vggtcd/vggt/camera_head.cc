// SPDX-License-Identifier: Apache-2.0
// CameraHead: iterative refinement (trunk_fn upstream). One token per frame, so everything here is
// small but the weights.
#include "vggtcd/vggt/camera_head.h"

#include <algorithm>

#include "vggtcd/core/parallel.h"
#include "vggtcd/nn/activation.h"

namespace vggtcd {
namespace {

PoseEncoding take_empty_pose(const WeightScope& scope) {
  const auto values = scope.take_f32("empty_pose_tokens", {1, 1, 9});
  PoseEncoding pose;
  std::copy(values.begin(), values.end(), pose.begin());
  return pose;
}

// y = linear(x) for any number of rows.
void run_all(const Linear& linear, int64_t rows, const Rows& x, const Rows& y) {
  parallel_for(rows, kRowBlock, [&](int64_t begin, int64_t end) {
    linear.run(end - begin, x.at(begin), y.at(begin));
  });
}

}  // namespace

CameraHead::CameraHead(const WeightScope& scope, const VggtConfig& config)
    : channels_(2 * config.channels),
      iterations_(config.camera_iterations),
      empty_pose_(take_empty_pose(scope)),
      token_norm_(scope.at("token_norm"), channels_, kEps),
      trunk_norm_(scope.at("trunk_norm"), channels_, kEps),
      embed_pose_(scope.at("embed_pose"), 9, channels_, {}),
      modulation_(scope.at("poseLN_modulation.1"), channels_, 3 * channels_, {}),
      trunk_(make_blocks(scope.at("trunk"), config.camera_depth,
                         {.channels = channels_, .heads = config.camera_heads, .eps = kEps})),
      branch_fc1_(scope.at("pose_branch.fc1"), channels_, channels_ / 2,
                  {.activation = Activation::kGelu}),
      branch_fc2_(scope.at("pose_branch.fc2"), channels_ / 2, 9, {.accumulate = true}) {}

// shift, scale, gate = poseLN_modulation(embedded).chunk(3)
// x = gate * (adaln_norm(pose_tokens) * (1 + scale) + shift) + pose_tokens
void CameraHead::modulate(int64_t frames, const Rows& pose_tokens, const Rows& embedded,
                          const Rows& x) const {
  const int64_t size = channels_;
  Buffer memory(bytes_of(DType::kF32, frames, 3 * size));
  const Rows modulation(DType::kF32, memory, 3 * size);
  silu_f32(frames * size, embedded.f32(), embedded.f32());
  run_all(modulation_, frames, embedded, modulation);  // [S, C] -> [S, 3C]
  layer_norm_f32(frames, size, pose_tokens.f32(), size, nullptr, nullptr, kAdaptiveNormEps, x.f32(),
                 size);
  for (int64_t s = 0; s < frames; ++s) {
    const float* shift = modulation.at(s).f32();
    const float* scale = shift + size;
    const float* gate = scale + size;
    const float* token = pose_tokens.at(s).f32();
    float* row = x.at(s).f32();
    for (int64_t c = 0; c < size; ++c) {
      row[c] = gate[c] * (row[c] * (1 + scale[c]) + shift[c]) + token[c];
    }
  }
}

std::vector<PoseEncoding> CameraHead::forward(const AggregatedTokens& tokens,
                                              const Trace& trace) const {
  const int64_t frames = tokens.frames;
  const auto buffer = [&](int64_t columns) {
    return Buffer(bytes_of(DType::kF32, frames, columns));
  };
  const Buffer pose_memory = buffer(channels_), x_memory = buffer(channels_),
               embedded_memory = buffer(channels_), hidden_memory = buffer(channels_ / 2);
  const Rows pose_tokens(DType::kF32, pose_memory, channels_);
  const Rows x(DType::kF32, x_memory, channels_);
  const Rows embedded(DType::kF32, embedded_memory, channels_);
  const Rows hidden(DType::kF32, hidden_memory, channels_ / 2);
  BlockWorkspace workspace(frames, channels_, trunk_.front().hidden(), DType::kF32);

  // pose_tokens = token_norm(aggregated_tokens_list[-1][:, :, 0]): row s is s frames further on.
  const Rows camera_tokens(tokens.frame(3, 0).f32(), tokens.tokens() * channels_);
  token_norm_.run(frames, camera_tokens, pose_tokens);

  std::vector<PoseEncoding> raw(static_cast<size_t>(frames), empty_pose_);
  std::vector<PoseEncoding> pose(static_cast<size_t>(frames));
  const Rows raw_rows(raw.front().data(), 9);
  for (int iteration = 0; iteration < iterations_; ++iteration) {
    // module_input = embed_pose(empty pose, then the prediction so far)
    run_all(embed_pose_, frames, raw_rows, embedded);
    modulate(frames, pose_tokens, embedded, x);
    // pose_tokens_modulated = trunk(...): attention across frames, no rotary embedding
    for (const Block& block : trunk_) block.forward(x, 1, frames, nullptr, nullptr, workspace);
    // pred_pose_enc += pose_branch(trunk_norm(...)); the first prediction is the branch alone
    if (iteration == 0) std::fill(raw.begin(), raw.end(), PoseEncoding{});
    trunk_norm_.run(frames, x, x);
    run_all(branch_fc1_, frames, x, hidden);
    run_all(branch_fc2_, frames, hidden, raw_rows);
    // activate_pose: linear, linear, relu
    pose = raw;
    for (PoseEncoding& one : pose) {
      one[7] = std::max(one[7], 0.0f);
      one[8] = std::max(one[8], 0.0f);
    }
    if (trace) {
      trace_tensor(trace, fmt::format("pose_enc_iter{}", iteration), {frames, 9},
                   pose.front().data());
    }
  }
  return pose;
}

}  // namespace vggtcd
