// SPDX-License-Identifier: Apache-2.0
// Element-wise steps against the definitions in double precision, at every instruction-set level.
#include "vggtcd/nn/activation.h"

#include <gmock/gmock.h>

#include <limits>

#include "vggtcd/core/error.h"
#include "vggtcd/nn/test_support.h"

namespace vggtcd {
namespace {

class Activation : public CpuLevelTest {};

// Every magnitude and both signs, and random numbers where the function bends; odd in number.
std::vector<float> probes() {
  std::vector<float> x = {0.0f, -0.0f, 1e-40f, -1e-40f};
  for (float magnitude = 1e-38f; magnitude < 1e38f; magnitude *= 1.7f) {
    x.push_back(magnitude);
    x.push_back(-magnitude);
  }
  for (float at = -15; at < 15; at += 0.003f) x.push_back(at);
  if (x.size() % 2 == 0) x.push_back(0.5f);
  return x;
}

std::vector<double> map(const std::vector<float>& x, double (*op)(double)) {
  std::vector<double> y;
  for (const float value : x) y.push_back(op(double{value}));
  return y;
}

TEST_P(Activation, GeluIsTheExactOne) {
  const auto x = probes();
  const auto expected = map(x, reference::gelu<double>);
  std::vector<float> y(x.size());
  gelu_f32(static_cast<int64_t>(x.size()), x.data(), y.data());
  std::vector<double> bound;
  for (size_t i = 0; i < x.size(); ++i) {
    // Relative, also in the tail: 5e-7 for the polynomials and roundings; the f32 exponent x^2 / 2
    // has an error of 2^-24 of itself, twice. Where f32 ends (1e-37 and below) it may be zero.
    const double square = std::min(double{x[i]} * double{x[i]} / 2, 100.0);
    bound.push_back(std::abs(expected[i]) * (5e-7 + square * 0x1p-22) + 1e-36);
  }
  expect_within(y, expected, bound);
}

TEST_P(Activation, GeluEndsInZeroAndInTheIdentity) {
  const float infinity = std::numeric_limits<float>::infinity();
  const float x[] = {infinity, 1e30f, 20.0f, -20.0f, -1e30f, NAN};
  float y[6];
  gelu_f32(6, x, y);
  EXPECT_EQ(y[0], infinity);
  EXPECT_EQ(y[1], 1e30f);
  EXPECT_EQ(y[2], 20.0f);
  EXPECT_NEAR(y[3], 0.0f, 1e-37);
  EXPECT_NEAR(y[4], 0.0f, 1e-37);
  EXPECT_TRUE(std::isnan(y[5]));
}

TEST_P(Activation, GeluInBf16IsTheF32ResultRounded) {
  const auto wide = probes();
  const auto size = static_cast<int64_t>(wide.size());
  std::vector<uint16_t> narrow(wide.size()), y(wide.size());
  std::vector<float> x(wide.size()), expected(wide.size());
  bf16_from_f32(size, wide.data(), narrow.data());
  f32_from_bf16(size, narrow.data(), x.data());
  gelu_f32(size, x.data(), expected.data());
  gelu_f32_to_bf16(size, x.data(), y.data());
  for (size_t i = 0; i < y.size(); ++i) EXPECT_EQ(y[i], bfloat16_from_float(expected[i])) << x[i];
  gelu_bf16(size, narrow.data(), narrow.data());  // in place
  EXPECT_EQ(narrow, y);
}

TEST_P(Activation, SiluIsTheDoubleResultToFloatPrecision) {
  const auto x = probes();
  const auto expected = map(x, reference::silu<double>);
  std::vector<float> y(x.size());
  silu_f32(static_cast<int64_t>(x.size()), x.data(), y.data());
  std::vector<double> bound;
  for (size_t i = 0; i < x.size(); ++i) {
    // exp(-x) has the error of its f32 exponent; beyond |x| = 85 it leaves f32's range.
    const double exponent = std::min(std::abs(double{x[i]}), 85.0);
    bound.push_back(std::abs(expected[i]) * (5e-7 + exponent * 0x1p-23) + 1e-35);
  }
  expect_within(y, expected, bound);
}

TEST_P(Activation, ConversionRoundsToNearestEvenAndBackIsExact) {
  std::vector<float> x = probes();
  for (const uint32_t bits : {0x3f808000u, 0x3f818000u, 0x3f808001u, 0x7f7fffffu, 0x7f800000u,
                              0xff800000u, 0x7f800001u, 0x7fffffffu, 0x00008000u, 0x80018000u}) {
    float value;
    std::memcpy(&value, &bits, sizeof(value));
    x.push_back(value);
  }
  const auto size = static_cast<int64_t>(x.size());
  std::vector<uint16_t> narrow(x.size());
  bf16_from_f32(size, x.data(), narrow.data());
  std::vector<float> back(x.size());
  f32_from_bf16(size, narrow.data(), back.data());
  for (size_t i = 0; i < x.size(); ++i) {
    EXPECT_EQ(narrow[i], bfloat16_from_float(x[i])) << x[i];
    EXPECT_EQ(bfloat16_from_float(back[i]), narrow[i]);
  }
}

TEST_P(Activation, AddScaledIsTheDoubleResultToFloatPrecision) {
  for (const int64_t channels : {1, 7, 16, 33, 1024}) {
    const int64_t rows = 5, size = rows * channels;
    const auto x = random_values<float>(size, 1), gamma = random_values<float>(channels, 2);
    const auto y = random_values<float>(size, 3);
    std::vector<uint16_t> narrow(y.size());
    bf16_from_f32(size, y.data(), narrow.data());
    for (const float* scale : {gamma.data(), static_cast<const float*>(nullptr)}) {
      std::vector<double> expected, expected_bf16;
      for (size_t i = 0; i < x.size(); ++i) {
        const double factor = scale ? double{scale[i % static_cast<size_t>(channels)]} : 1;
        expected.push_back(double{x[i]} + factor * double{y[i]});
        expected_bf16.push_back(double{x[i]} + factor * reference::load<double>(narrow[i]));
      }
      auto sum = x, sum_bf16 = x;
      add_scaled_f32(rows, channels, sum.data(), scale, y.data());
      add_scaled_bf16(rows, channels, sum_bf16.data(), scale, narrow.data());
      EXPECT_LE(relative_l2(sum, expected), 1e-7) << channels;
      EXPECT_LE(relative_l2(sum_bf16, expected_bf16), 1e-7) << channels;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(, Activation, ::testing::ValuesIn(kAllCpuLevels), cpu_level_name);

}  // namespace
}  // namespace vggtcd
