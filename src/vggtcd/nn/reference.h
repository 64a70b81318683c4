// SPDX-License-Identifier: Apache-2.0
// The definition of every operation of this room that has vector code: plain loops, in the
// arithmetic of Real. reference::op<double> is the oracle of the tests, reference::op<float> is
// what runs at CpuLevel::kReference.
//
// Elements are float, or uint16_t holding a bfloat16; results may also be double.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <vector>

#include "vggtcd/core/tensor_view.h"

namespace vggtcd::reference {

template <typename Real, typename T>
Real load(T element) {
  if constexpr (std::is_same_v<T, uint16_t>) {
    return static_cast<Real>(float_from_bfloat16(element));
  } else {
    return static_cast<Real>(element);
  }
}

template <typename T, typename Real>
T store(Real value) {
  if constexpr (std::is_same_v<T, uint16_t>) {
    return bfloat16_from_float(static_cast<float>(value));
  } else {
    return static_cast<T>(value);
  }
}

// out = softmax(scale * q k^T) v for one query and one head: q [head_dim], out [head_dim]; k and v
// [tokens, head_dim] with rows row_stride apart; scores: scratch.
template <typename Real, typename T, typename Out>
void attention_row(int64_t tokens, int64_t head_dim, const T* q, const T* k, const T* v,
                   int64_t row_stride, Out* out, Real scale, std::vector<Real>& scores) {
  scores.resize(static_cast<size_t>(tokens));
  Real largest = -std::numeric_limits<Real>::infinity();
  for (int64_t j = 0; j < tokens; ++j) {
    Real dot = 0;
    for (int64_t c = 0; c < head_dim; ++c) {
      dot += load<Real>(q[c]) * load<Real>(k[j * row_stride + c]);
    }
    scores[static_cast<size_t>(j)] = scale * dot;
    largest = std::max(largest, scale * dot);
  }
  Real sum = 0;
  for (Real& score : scores) sum += score = std::exp(score - largest);
  for (int64_t c = 0; c < head_dim; ++c) {
    Real weighted = 0;
    for (int64_t j = 0; j < tokens; ++j) {
      weighted += scores[static_cast<size_t>(j)] * load<Real>(v[j * row_stride + c]);
    }
    out[c] = store<Out>(weighted / sum);
  }
}

// y = (x - mean) / sqrt(variance + eps) * weight + bias over one row; variance is the biased one;
// weight, bias: null for 1 and 0.
template <typename Real, typename T, typename Out>
void layer_norm_row(int64_t channels, const T* x, const float* weight, const float* bias, Real eps,
                    Out* y) {
  Real mean = 0;
  for (int64_t c = 0; c < channels; ++c) mean += load<Real>(x[c]);
  mean /= static_cast<Real>(channels);
  Real variance = 0;
  for (int64_t c = 0; c < channels; ++c) {
    const Real centred = load<Real>(x[c]) - mean;
    variance += centred * centred;
  }
  variance /= static_cast<Real>(channels);
  const Real scale = 1 / std::sqrt(variance + eps);
  for (int64_t c = 0; c < channels; ++c) {
    const Real normal = (load<Real>(x[c]) - mean) * scale;
    y[c] = store<Out>((weight ? normal * Real{weight[c]} : normal) + (bias ? Real{bias[c]} : 0));
  }
}

// Rotary embedding of one head in 2-D: the first half of the channels turns by y, the second by x.
// Inside a half, channel k pairs with k + quarter and the angle is
// position * frequency_base^(-k / quarter), quarter = head_dim / 4.
template <typename Real>
void rope_head(int64_t head_dim, int64_t y, int64_t x, Real frequency_base, Real* head) {
  const int64_t quarter = head_dim / 4;
  for (int64_t half = 0; half < 2; ++half) {
    Real* first = head + half * 2 * quarter;
    for (int64_t k = 0; k < quarter; ++k) {
      const Real exponent = -static_cast<Real>(k) / static_cast<Real>(quarter);
      const Real angle = static_cast<Real>(half == 0 ? y : x) * std::pow(frequency_base, exponent);
      const Real a = first[k], b = first[k + quarter];
      first[k] = a * std::cos(angle) - b * std::sin(angle);
      first[k + quarter] = b * std::cos(angle) + a * std::sin(angle);
    }
  }
}

// x * Phi(x), Phi the normal distribution function.
template <typename Real>
Real gelu(Real x) {
  return x * Real{0.5} * std::erfc(-x * static_cast<Real>(0.70710678118654752440));
}

// x / (1 + exp(-x)).
template <typename Real>
Real silu(Real x) {
  return x / (1 + std::exp(-x));
}

}  // namespace vggtcd::reference
