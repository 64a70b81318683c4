// SPDX-License-Identifier: Apache-2.0
// Element-wise steps: partition and choice of the kernel.
#include "vggtcd/nn/activation.h"

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/nn/reference.h"

namespace vggtcd {
namespace {

constexpr int64_t kGrain = 1 << 15;  // elements: a chunk costs more than waking a thread

template <typename T, typename Out, typename Op>
void map(int64_t size, const T* x, Out* y, Op op) {
  parallel_for(size, kGrain, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      y[i] = reference::store<Out>(op(reference::load<float>(x[i])));
    }
  });
}

template <typename T>
void add_scaled(int64_t rows, int64_t channels, float* x, const float* gamma, const T* y) {
  check(rows >= 0 && channels >= 1, "add_scaled: shape");
  parallel_for(rows, num_chunks(kGrain, channels), [&](int64_t begin, int64_t end) {
    for (int64_t i = begin * channels; i < end * channels; ++i) {
      const float value = reference::load<float>(y[i]);
      x[i] += gamma ? gamma[i % channels] * value : value;
    }
  });
}

}  // namespace

void gelu_f32(int64_t size, const float* x, float* y) { map(size, x, y, reference::gelu<float>); }

void gelu_bf16(int64_t size, const uint16_t* x, uint16_t* y) {
  map(size, x, y, reference::gelu<float>);
}

void gelu_f32_to_bf16(int64_t size, const float* x, uint16_t* y) {
  map(size, x, y, reference::gelu<float>);
}

void silu_f32(int64_t size, const float* x, float* y) { map(size, x, y, reference::silu<float>); }

void add_scaled_f32(int64_t rows, int64_t channels, float* x, const float* gamma, const float* y) {
  add_scaled(rows, channels, x, gamma, y);
}

void add_scaled_bf16(int64_t rows, int64_t channels, float* x, const float* gamma,
                     const uint16_t* y) {
  add_scaled(rows, channels, x, gamma, y);
}

void bf16_from_f32(int64_t size, const float* x, uint16_t* y) {
  map(size, x, y, [](float value) { return value; });
}

void f32_from_bf16(int64_t size, const uint16_t* x, float* y) {
  map(size, x, y, [](float value) { return value; });
}

}  // namespace vggtcd
