// SPDX-License-Identifier: Apache-2.0
// LayerNorm: layer normalisation with the weights of one layer (torch.nn.LayerNorm).
#pragma once

#include <vector>

#include "vggtcd/nn/layer_norm.h"
#include "vggtcd/nn/tensor.h"
#include "vggtcd/nn/weights.h"

namespace vggtcd {

class LayerNorm {
 public:
  // Takes "weight" and "bias" [channels] of the scope. The network mixes eps 1e-5 and 1e-6.
  LayerNorm(const WeightScope& scope, int64_t channels, float eps)
      : weight_(scope.take_f32("weight", {channels})),
        bias_(scope.take_f32("bias", {channels})),
        eps_(eps) {}

  // x f32, y f32 (may be x) or bf16; on the calling thread.
  void run(int64_t rows, const Rows& x, const Rows& y) const {
    const int64_t channels = std::ssize(weight_);
    if (y.dtype == DType::kF32) {
      layer_norm_f32(rows, channels, x.f32(), x.stride, weight_.data(), bias_.data(), eps_, y.f32(),
                     y.stride);
    } else {
      layer_norm_bf16(rows, channels, x.f32(), x.stride, weight_.data(), bias_.data(), eps_,
                      y.bf16(), y.stride);
    }
  }

  const float* weight() const { return weight_.data(); }
  const float* bias() const { return bias_.data(); }
  float eps() const { return eps_; }

 private:
  std::vector<float> weight_, bias_;
  float eps_;
};

}  // namespace vggtcd
