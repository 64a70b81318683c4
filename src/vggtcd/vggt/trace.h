// SPDX-License-Identifier: Apache-2.0
// Trace: a callback that sees the tensors between the stages of a forward pass, for golden tests
// and for finding where two implementations part.
#pragma once

#include <functional>
#include <span>
#include <string>

#include "vggtcd/core/tensor_view.h"

namespace vggtcd {

// Receives f32 tensors in the order of the pass: vit_embed, vit_block_00.., patch_tokens, frame_00,
// global_00, .., head_tokens_0.., pose_enc_iter0.., dpt_layer1_rn.., all of one frame at a time, ..
// The memory is valid during the call only. Tracing copies some tensors: not for timing.
using Trace = std::function<void(const TensorView&)>;

inline void trace_tensor(const Trace& trace, std::string name, std::vector<int64_t> shape,
                         const float* values) {
  TensorView view{std::move(name), DType::kF32, std::move(shape), {}};
  view.data = std::as_bytes(std::span(values, static_cast<size_t>(view.numel())));
  trace(view);
}

}  // namespace vggtcd
