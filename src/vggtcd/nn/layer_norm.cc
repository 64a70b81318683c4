// SPDX-License-Identifier: Apache-2.0
// Layer normalisation of rows: partition and choice of the kernel.
#include "vggtcd/nn/layer_norm.h"

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/nn/reference.h"

namespace vggtcd {
namespace {

template <typename Out>
void layer_norm(int64_t rows, int64_t channels, const float* x, int64_t x_stride,
                const float* weight, const float* bias, float eps, Out* y, int64_t y_stride) {
  check(rows >= 0 && channels >= 1, "layer_norm: shape");
  check(x_stride >= channels && y_stride >= channels, "layer_norm: strides");
  parallel_for(rows, 64, [&](int64_t begin, int64_t end) {
    for (int64_t row = begin; row < end; ++row) {
      reference::layer_norm_row<float>(channels, x + row * x_stride, weight, bias, eps,
                                       y + row * y_stride);
    }
  });
}

}  // namespace

void layer_norm_f32(int64_t rows, int64_t channels, const float* x, int64_t x_stride,
                    const float* weight, const float* bias, float eps, float* y, int64_t y_stride) {
  layer_norm(rows, channels, x, x_stride, weight, bias, eps, y, y_stride);
}

void layer_norm_bf16(int64_t rows, int64_t channels, const float* x, int64_t x_stride,
                     const float* weight, const float* bias, float eps, uint16_t* y,
                     int64_t y_stride) {
  layer_norm(rows, channels, x, x_stride, weight, bias, eps, y, y_stride);
}

}  // namespace vggtcd
