// SPDX-License-Identifier: Apache-2.0
// The functions of row_kernels.h for any of the vector types. Internal linkage: every instruction
// set has its own. Sums over a row run in four interleaved vectors, added pairwise at the end: an
// order that depends on the instruction set, not on threads.
#pragma once

#include <cstdint>

#include "vggtcd/nn/row_kernels.h"
#include "vggtcd/nn/simd_math.h"

namespace vggtcd {
namespace {

template <typename S>
struct RowOps {
  using V = typename S::V;
  static constexpr int64_t kLanes = S::kLanes;

  static V load(const float* p) { return S::load(p); }
  static V load(const uint16_t* p) { return S::load_bf16(p); }
  static V load_first(const float* p, int64_t n) { return S::load_first(p, n); }
  static V load_first(const uint16_t* p, int64_t n) { return S::load_first_bf16(p, n); }
  static void store(float* p, V a) { S::store(p, a); }
  static void store(uint16_t* p, V a) { S::store_bf16(p, a); }
  static void store_first(float* p, V a, int64_t n) { S::store_first(p, a, n); }
  static void store_first(uint16_t* p, V a, int64_t n) { S::store_first_bf16(p, a, n); }

  // y[i] = op(x[i])
  template <typename In, typename Out, typename Op>
  static void map(int64_t size, const In* x, Out* y, Op op) {
    int64_t i = 0;
    for (; i + kLanes <= size; i += kLanes) store(y + i, op(load(x + i)));
    if (i < size) store_first(y + i, op(load_first(x + i, size - i)), size - i);
  }

  template <typename In, typename Out>
  static void gelu(int64_t size, const In* x, Out* y) {
    map(size, x, y, [](V a) { return gelu_f32<S>(a); });
  }
  static void silu(int64_t size, const float* x, float* y) {
    map(size, x, y, [](V a) { return silu_f32<S>(a); });
  }
  template <typename In, typename Out>
  static void convert(int64_t size, const In* x, Out* y) {
    map(size, x, y, [](V a) { return a; });
  }

  template <typename T>
  static void add_scaled(int64_t channels, float* x, const float* gamma, const T* y) {
    int64_t c = 0;
    for (; c + kLanes <= channels; c += kLanes) {
      const V a = load(y + c), g = gamma ? S::load(gamma + c) : S::set(1.0f);
      S::store(x + c, S::fma(g, a, S::load(x + c)));
    }
    if (const int64_t n = channels - c; n > 0) {
      const V a = load_first(y + c, n), g = gamma ? S::load_first(gamma + c, n) : S::set(1.0f);
      S::store_first(x + c, S::fma(g, a, S::load_first(x + c, n)), n);
    }
  }

  static void lerp(int64_t size, const float* x0, const float* x1, float weight, const float* add,
                   float* y) {
    const V w = S::set(weight);
    int64_t i = 0;
    for (; i + kLanes <= size; i += kLanes) {
      const V a = S::load(x0 + i), b = S::load(x1 + i);
      const V value = S::fma(w, S::sub(b, a), a);
      S::store(y + i, add ? S::add(value, S::load(add + i)) : value);
    }
    if (const int64_t n = size - i; n > 0) {
      const V a = S::load_first(x0 + i, n), b = S::load_first(x1 + i, n);
      const V value = S::fma(w, S::sub(b, a), a);
      S::store_first(y + i, add ? S::add(value, S::load_first(add + i, n)) : value, n);
    }
  }

  // The sum over x of op(element).
  template <typename Op>
  static float sum(int64_t size, const float* x, Op op) {
    V part[4] = {S::zero(), S::zero(), S::zero(), S::zero()};
    int64_t i = 0;
    for (; i + 4 * kLanes <= size; i += 4 * kLanes) {
      for (int64_t k = 0; k < 4; ++k) {
        part[k] = S::add(part[k], op(S::load(x + i + k * kLanes)));
      }
    }
    for (; i + kLanes <= size; i += kLanes) part[0] = S::add(part[0], op(S::load(x + i)));
    if (const int64_t n = size - i; n > 0) {
      part[1] = S::add(part[1], S::keep_first(op(S::load_first(x + i, n)), n));
    }
    return S::sum(S::add(S::add(part[0], part[1]), S::add(part[2], part[3])));
  }

  template <typename Out>
  static void layer_norm(const RowNorm& norm, const float* x, Out* y) {
    const int64_t channels = norm.channels;
    const float count = static_cast<float>(channels);
    const V mean = S::set(sum(channels, x, [](V a) { return a; }) / count);
    const float variance = sum(channels, x,
                               [mean](V a) {
                                 const V centred = S::sub(a, mean);
                                 return S::mul(centred, centred);
                               }) /
                           count;
    const V scale = S::div(S::set(1.0f), S::sqrt(S::set(variance + norm.eps)));
    int64_t c = 0;
    for (; c + kLanes <= channels; c += kLanes) {
      V value = S::mul(S::sub(S::load(x + c), mean), scale);
      if (norm.weight) value = S::mul(value, S::load(norm.weight + c));
      if (norm.bias) value = S::add(value, S::load(norm.bias + c));
      store(y + c, value);
    }
    if (const int64_t n = channels - c; n > 0) {
      V value = S::mul(S::sub(S::load_first(x + c, n), mean), scale);
      if (norm.weight) value = S::mul(value, S::load_first(norm.weight + c, n));
      if (norm.bias) value = S::add(value, S::load_first(norm.bias + c, n));
      store_first(y + c, value, n);
    }
  }

  // The vectors of one head, from normalisation to rotation.
  template <int kQuarter>  // vectors in a quarter of the head
  static void norm_head(const HeadsNormRope& op, V (&head)[4 * kQuarter]) {
    constexpr float kCount = static_cast<float>(4 * kQuarter * kLanes);
    V total = head[0];
    for (int i = 1; i < 4 * kQuarter; ++i) total = S::add(total, head[i]);
    const V mean = S::set(S::sum(total) / kCount);
    V squares = S::zero();
    for (V& h : head) {
      h = S::sub(h, mean);
      squares = S::fma(h, h, squares);
    }
    const V variance = S::set(S::sum(squares) / kCount);
    const V scale = S::div(S::set(1.0f), S::sqrt(S::add(variance, S::set(op.eps))));
    for (int i = 0; i < 4 * kQuarter; ++i) {
      const V weight = S::load(op.weight + i * kLanes), bias = S::load(op.bias + i * kLanes);
      head[i] = S::fma(S::mul(head[i], scale), weight, bias);
    }
  }

  template <int kQuarter>
  static void rotate_half(const float* cosines, const float* sines, V* half) {
    for (int i = 0; i < kQuarter; ++i) {
      const V a = half[i], b = half[i + kQuarter];
      const V cosine = S::load(cosines + i * kLanes), sine = S::load(sines + i * kLanes);
      half[i] = S::fnma(b, sine, S::mul(a, cosine));
      half[i + kQuarter] = S::fma(a, sine, S::mul(b, cosine));
    }
  }

  template <int kQuarter, typename T>
  static void norm_rope_heads(const HeadsNormRope& op, T* row) {
    for (int64_t h = 0; h < op.heads; ++h, row += op.head_dim) {
      V head[4 * kQuarter];
      for (int i = 0; i < 4 * kQuarter; ++i) head[i] = load(row + i * kLanes);
      if (op.weight) norm_head<kQuarter>(op, head);
      if (op.cosines_y) {
        rotate_half<kQuarter>(op.cosines_y, op.sines_y, head);
        rotate_half<kQuarter>(op.cosines_x, op.sines_x, head + 2 * kQuarter);
      }
      for (int i = 0; i < 4 * kQuarter; ++i) store(row + i * kLanes, head[i]);
    }
  }

  template <typename T>
  static void norm_rope(const HeadsNormRope& op, T* row) {
    constexpr int kQuarterOf64 = 16 / S::kLanes;
    if (op.head_dim == 64) {
      norm_rope_heads<kQuarterOf64>(op, row);
    } else {
      norm_rope_heads<2 * kQuarterOf64>(op, row);
    }
  }

  static constexpr RowKernels table() {
    return {layer_norm<float>,
            layer_norm<uint16_t>,
            norm_rope<float>,
            norm_rope<uint16_t>,
            gelu<float, float>,
            gelu<uint16_t, uint16_t>,
            gelu<float, uint16_t>,
            silu,
            convert<float, uint16_t>,
            convert<uint16_t, float>,
            add_scaled<float>,
            add_scaled<uint16_t>,
            lerp};
  }
};

}  // namespace
}  // namespace vggtcd
