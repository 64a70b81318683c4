// SPDX-License-Identifier: Apache-2.0
// Layer normalisation of rows: partition and choice of the kernel.
#include "vggtcd/nn/layer_norm.h"

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/nn/reference.h"
#include "vggtcd/nn/row_kernels.h"

namespace vggtcd {
namespace {

template <typename Out>
void layer_norm(int64_t rows, const RowNorm& norm, const float* x, int64_t x_stride, Out* y,
                int64_t y_stride) {
  check(rows >= 0 && norm.channels >= 1, "layer_norm: shape");
  check(x_stride >= norm.channels && y_stride >= norm.channels, "layer_norm: strides");
  const RowKernels* kernels = row_kernels();
  parallel_for(rows, 32, [&](int64_t begin, int64_t end) {
    for (int64_t row = begin; row < end; ++row) {
      const float* from = x + row * x_stride;
      Out* to = y + row * y_stride;
      if (!kernels) {
        reference::layer_norm_row<float>(norm.channels, from, norm.weight, norm.bias, norm.eps, to);
      } else if constexpr (sizeof(Out) == 4) {
        kernels->layer_norm_f32(norm, from, to);
      } else {
        kernels->layer_norm_bf16(norm, from, to);
      }
    }
  });
}

}  // namespace

void layer_norm_f32(int64_t rows, int64_t channels, const float* x, int64_t x_stride,
                    const float* weight, const float* bias, float eps, float* y, int64_t y_stride) {
  layer_norm(rows, RowNorm{channels, weight, bias, eps}, x, x_stride, y, y_stride);
}

void layer_norm_bf16(int64_t rows, int64_t channels, const float* x, int64_t x_stride,
                     const float* weight, const float* bias, float eps, uint16_t* y,
                     int64_t y_stride) {
  layer_norm(rows, RowNorm{channels, weight, bias, eps}, x, x_stride, y, y_stride);
}

}  // namespace vggtcd
