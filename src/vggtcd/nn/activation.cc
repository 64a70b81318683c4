// SPDX-License-Identifier: Apache-2.0
// Element-wise steps: partition and choice of the kernel.
#include "vggtcd/nn/activation.h"

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/nn/reference.h"
#include "vggtcd/nn/row_kernels.h"

namespace vggtcd {
namespace {

constexpr int64_t kGrain = 1 << 15;  // elements: a chunk costs more than waking a thread

// y = op(x) by the kernel where this processor has one, else element by element.
template <typename T, typename Out, typename Op>
void map(int64_t size, const T* x, Out* y, void (*RowKernels::*kernel)(int64_t, const T*, Out*),
         Op op) {
  const RowKernels* kernels = row_kernels();
  parallel_for(size, kGrain, [&](int64_t begin, int64_t end) {
    if (kernels) return (kernels->*kernel)(end - begin, x + begin, y + begin);
    for (int64_t i = begin; i < end; ++i) {
      y[i] = reference::store<Out>(op(reference::load<float>(x[i])));
    }
  });
}

template <typename T>
void add_scaled(int64_t rows, int64_t channels, float* x, const float* gamma, const T* y,
                void (*RowKernels::*kernel)(int64_t, float*, const float*, const T*)) {
  check(rows >= 0 && channels >= 1, "add_scaled: shape");
  const RowKernels* kernels = row_kernels();
  parallel_for(rows, num_chunks(kGrain, channels), [&](int64_t begin, int64_t end) {
    for (int64_t row = begin; row < end; ++row) {
      float* to = x + row * channels;
      const T* from = y + row * channels;
      if (kernels) {
        (kernels->*kernel)(channels, to, gamma, from);
        continue;
      }
      for (int64_t c = 0; c < channels; ++c) {
        const float value = reference::load<float>(from[c]);
        to[c] += gamma ? gamma[c] * value : value;
      }
    }
  });
}

float identity(float value) { return value; }

}  // namespace

void gelu_f32(int64_t size, const float* x, float* y) {
  map(size, x, y, &RowKernels::gelu_f32, reference::gelu<float>);
}

void gelu_bf16(int64_t size, const uint16_t* x, uint16_t* y) {
  map(size, x, y, &RowKernels::gelu_bf16, reference::gelu<float>);
}

void gelu_f32_to_bf16(int64_t size, const float* x, uint16_t* y) {
  map(size, x, y, &RowKernels::gelu_f32_to_bf16, reference::gelu<float>);
}

void silu_f32(int64_t size, const float* x, float* y) {
  map(size, x, y, &RowKernels::silu_f32, reference::silu<float>);
}

void add_scaled_f32(int64_t rows, int64_t channels, float* x, const float* gamma, const float* y) {
  add_scaled(rows, channels, x, gamma, y, &RowKernels::add_scaled_f32);
}

void add_scaled_bf16(int64_t rows, int64_t channels, float* x, const float* gamma,
                     const uint16_t* y) {
  add_scaled(rows, channels, x, gamma, y, &RowKernels::add_scaled_bf16);
}

void bf16_from_f32(int64_t size, const float* x, uint16_t* y) {
  map(size, x, y, &RowKernels::bf16_from_f32, identity);
}

void f32_from_bf16(int64_t size, const uint16_t* x, float* y) {
  map(size, x, y, &RowKernels::f32_from_bf16, identity);
}

}  // namespace vggtcd
