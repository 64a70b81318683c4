// SPDX-License-Identifier: Apache-2.0
// exp2 and what is built on it, for any of the vector types (simd_*.h). Minimax polynomials fitted
// for relative error by Lawson's iteration. Internal linkage, as there.
#pragma once

namespace vggtcd {
namespace {

// 2^x for x <= 127; relative error 2e-7 (rounding; the polynomial alone 2e-9), 0 below -126 or so.
template <typename S>
inline typename S::V exp2_f32(typename S::V x) {
  const auto n = S::round(x);
  const auto f = S::sub(x, n);
  auto p = S::set(1.5345811e-04f);
  p = S::fma(p, f, S::set(1.3399931e-03f));
  p = S::fma(p, f, S::set(9.618489e-03f));
  p = S::fma(p, f, S::set(5.5503286e-02f));
  p = S::fma(p, f, S::set(2.4022646e-01f));
  p = S::fma(p, f, S::set(6.931472e-01f));
  p = S::fma(p, f, S::set(1.0f));
  return S::scale_by_power_of_2(p, n);
}

// x * Phi(x). With a = |x| and t = 1 / (1 + 0.3 a), the tail Phi(-a) is exp(-a^2 / 2) times a
// polynomial in t, relative error 1.2e-7 up to a = 13, where the exponential underflows.
template <typename S>
inline typename S::V gelu_f32(typename S::V x) {
  const auto a = S::abs(x);
  const auto t = S::div(S::set(1.0f), S::fma(a, S::set(0.3f), S::set(1.0f)));
  auto p = S::set(3.619482e-02f);
  p = S::fma(p, t, S::set(-1.5937817e-01f));
  p = S::fma(p, t, S::set(2.1011817e-01f));
  p = S::fma(p, t, S::set(-5.716718e-02f));
  p = S::fma(p, t, S::set(1.3041636e-01f));
  p = S::fma(p, t, S::set(9.934719e-02f));
  p = S::fma(p, t, S::set(1.2084553e-01f));
  p = S::fma(p, t, S::set(1.19623266e-01f));
  // Below -1000 the exponential is 0 anyway; the bound keeps an infinity out of exp2.
  const auto square = S::mul(a, S::mul(a, S::set(-0.72134752f)));  // log2(e) / 2
  const auto tail = S::mul(S::mul(p, t), exp2_f32<S>(S::max(S::set(-1000.0f), square)));
  const auto phi = S::select_greater(x, S::zero(), S::sub(S::set(1.0f), tail), tail);
  return S::mul(x, phi);
}

// x / (1 + exp(-x)).
template <typename S>
inline typename S::V silu_f32(typename S::V x) {
  const auto exponent = S::mul(S::abs(x), S::set(-1.44269504f));  // log2(e)
  const auto e = exp2_f32<S>(S::max(S::set(-1000.0f), exponent));
  const auto numerator = S::select_greater(x, S::zero(), S::set(1.0f), e);
  return S::mul(x, S::div(numerator, S::add(S::set(1.0f), e)));
}

}  // namespace
}  // namespace vggtcd
