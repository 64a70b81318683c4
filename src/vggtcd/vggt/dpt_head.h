// SPDX-License-Identifier: Apache-2.0
// DptHead: four layers of tokens -> one dense map per frame; upstream vggt.heads.dpt_head.DPTHead.
// Both the depth head and the point head are one. Maps are channels-last: a token is a pixel.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "vggtcd/nn/conv3x3.h"
#include "vggtcd/vggt/aggregator.h"

namespace vggtcd {

// A channels-last map and its memory, which grows once and is used for every frame.
struct DptMap {
  int64_t height = 0, width = 0, channels = 0;
  DType dtype = DType::kF32;
  Buffer memory;

  void resize(DType type, int64_t new_height, int64_t new_width, int64_t new_channels);
  int64_t pixels() const { return height * width; }
  Rows rows() const { return Rows(dtype, memory, channels); }
};

// The maps of one frame, whatever the number of frames.
struct DptWorkspace {
  std::array<DptMap, 4> reassembled;  // after layerN_rn, [h, w, features]
  DptMap projected, stage;            // before it
  DptMap path, narrow, wide;          // along the fusion and the output
  DptMap input, hidden;               // of convolutions
};

// x + conv2(relu(conv1(relu(x)))), upstream ResidualConvUnit, where the first relu is in place: the
// sum has relu(x).
class ResidualUnit {
 public:
  ResidualUnit(const WeightScope& scope, int64_t features, ProductTypes types);
  // into += relu(x) + conv2(relu(conv1(relu(x)))); into == x: x = that. Overwrites x.
  void add_to(DptMap& x, DptMap& into, DptWorkspace& workspace) const;

 private:
  Conv3x3 conv1_, conv2_;
};

class DptHead {
 public:
  // scope: depth_head or point_head; outputs: channels of the result; name: of traced tensors.
  DptHead(const WeightScope& scope, const VggtConfig& config, int64_t outputs, ProductTypes types,
          std::string name);

  // out [height, width, outputs]: the raw result of one frame, before its activations. height and
  // width are the photo's.
  void forward(const AggregatedTokens& tokens, int64_t frame, int64_t height, int64_t width,
               float* out, DptWorkspace& workspace, const Trace& trace) const;

  int64_t outputs() const { return output_conv2_last_.out(); }

 private:
  struct Fusion {
    std::optional<ResidualUnit> unit1;  // the coarsest level has none
    ResidualUnit unit2;
    Linear out_conv;
  };
  struct Frame;  // what all steps of one frame need

  Fusion make_fusion(const WeightScope& scope, int64_t features, bool coarsest) const;
  void reassemble(const Frame& frame, size_t level) const;
  void project(const Frame& frame, size_t level, DptMap& target) const;
  void upsample(const Frame& frame, const Linear& linear, int64_t factor, const DptMap& source,
                DptMap& target) const;
  void fuse(const Frame& frame, size_t level) const;
  void output(const Frame& frame, float* out) const;

  std::string name_;
  ProductTypes types_;
  LayerNorm norm_;
  std::vector<Linear> projects_;       // 1x1 convolutions, one per level
  std::vector<Linear> resize_layers_;  // transposed 4x4 of stride 4, transposed 2x2 of stride 2
  std::optional<Conv3x3> downsample_;  // resize_layers.3
  std::vector<Conv3x3> layer_rn_;
  std::vector<Fusion> fusions_;  // refinenet1 .. 4
  Conv3x3 output_conv1_, output_conv2_first_;
  Linear output_conv2_last_;
};

// Activations of the results (vggt.heads.head_act.activate_head: "exp", "inv_log", "expp1").
float activate_depth(float raw);       // exp(x)
float activate_point(float raw);       // sign(x) (exp(|x|) - 1)
float activate_confidence(float raw);  // 1 + exp(x)

}  // namespace vggtcd
