// SPDX-License-Identifier: Apache-2.0
// The panel kernel: a block of rows times weights in panels; the arithmetic is f32, whatever the
// weights are kept in.
//
// A panel holds three vectors of output channels, input channel by input channel. A block of it
// that fits into the first-level cache is widened to f32 once and then meets all rows of the call,
// so that weights in bf16 take half the memory and hardly more time. A sum runs over the input
// channels in order, in blocks whose size the instruction set fixes: the bits of a row do not
// depend on the rows around it.
#pragma once

#include <cstddef>
#include <cstdint>

#include "vggtcd/core/tensor_view.h"
#include "vggtcd/nn/linear.h"

namespace vggtcd {

// y = act(x W^T + b), or y += gamma * (x W^T + b). The pointers to bias and gamma are null where
// there is none.
struct PanelTask {
  int64_t rows, in, out;
  const float* x;
  int64_t x_stride;
  const std::byte* panels;
  bool bf16;  // the panels' elements, else f32
  const float* bias;
  const float* gamma;
  bool accumulate;
  Activation activation;
  float* y;
  int64_t y_stride;
  float* scratch;  // kPanelScratchFloats
};

constexpr int64_t kPanelScratchFloats = 8192;

struct PanelKernel {
  int64_t panel_channels;   // output channels of a panel
  int64_t vector_channels;  // the last panel is padded with zeros to a multiple of this
  void (*run)(const PanelTask& task);
};

const PanelKernel& panel_kernel_avx2();
const PanelKernel& panel_kernel_avx512();

}  // namespace vggtcd
