// SPDX-License-Identifier: Apache-2.0
// Layer normalisation against plain loops in double precision, at every instruction-set level.
#include "vggtcd/nn/layer_norm.h"

#include <gmock/gmock.h>

#include "vggtcd/core/error.h"
#include "vggtcd/nn/test_support.h"

namespace vggtcd {
namespace {

class LayerNorm : public CpuLevelTest {};

struct Rows {
  int64_t rows, channels, stride;
  std::vector<float> x;
};

Rows make_rows(int64_t rows, int64_t channels, float size, float offset) {
  Rows made{rows, channels, channels + 3, random_values<float>(rows * (channels + 3))};
  for (float& value : made.x) value = size * value + offset;
  return made;
}

std::vector<double> expect(const Rows& x, const float* weight, const float* bias, float eps) {
  std::vector<double> y(static_cast<size_t>(x.rows * x.channels));
  for (int64_t row = 0; row < x.rows; ++row) {
    reference::layer_norm_row<double>(x.channels, x.x.data() + row * x.stride, weight, bias,
                                      double{eps}, y.data() + row * x.channels);
  }
  return y;
}

std::vector<float> run_f32(const Rows& x, const float* weight, const float* bias, float eps) {
  std::vector<float> y(static_cast<size_t>(x.rows * x.channels));
  layer_norm_f32(x.rows, x.channels, x.x.data(), x.stride, weight, bias, eps, y.data(), x.channels);
  return y;
}

TEST_P(LayerNorm, IsTheDoubleResultToFloatPrecisionForAnyWidth) {
  for (const int64_t channels :
       {2, 3, 7, 8, 15, 16, 17, 31, 33, 63, 64, 65, 100, 129, 1024, 2050}) {
    const Rows x = make_rows(5, channels, 1.0f, 0.5f);
    const auto weight = random_values<float>(channels, 2), bias = random_values<float>(channels, 3);
    // The mean and the variance are sums of up to 2050 terms in 16 or more parts.
    EXPECT_LE(relative_l2(run_f32(x, weight.data(), bias.data(), 1e-5f),
                          expect(x, weight.data(), bias.data(), 1e-5f)),
              5e-7)
        << channels;
    EXPECT_LE(relative_l2(run_f32(x, nullptr, nullptr, 1e-6f), expect(x, nullptr, nullptr, 1e-6f)),
              5e-7)
        << channels;
  }
}

TEST_P(LayerNorm, KeepsItsPrecisionFarFromZero) {
  const Rows x = make_rows(3, 1024, 1.0f, 1000.0f);
  // The mean is a sum of 1024 values of 1000: in 64 parts it is good to a spacing of f32 at 1000,
  // 6e-5; added one by one (the plain loops) to some 30 times that.
  const double bound = GetParam() == CpuLevel::kReference ? 2e-3 : 6e-5;
  EXPECT_LE(relative_l2(run_f32(x, nullptr, nullptr, 1e-5f), expect(x, nullptr, nullptr, 1e-5f)),
            bound);
}

TEST_P(LayerNorm, TellsEpsilonsApart) {
  const Rows x = make_rows(3, 64, 1e-2f, 0.0f);
  const auto expected = expect(x, nullptr, nullptr, 1e-5f);
  EXPECT_LE(relative_l2(run_f32(x, nullptr, nullptr, 1e-5f), expected), 5e-7);
  EXPECT_GE(relative_l2(run_f32(x, nullptr, nullptr, 1e-6f), expected), 1e-2);
}

TEST_P(LayerNorm, TakesTinyAndLargeRows) {
  for (const float size : {1e-15f, 1e-3f, 1e3f, 1e15f}) {
    const Rows x = make_rows(2, 77, size, 0.0f);
    EXPECT_LE(relative_l2(run_f32(x, nullptr, nullptr, 1e-6f), expect(x, nullptr, nullptr, 1e-6f)),
              5e-7)
        << size;
  }
}

TEST_P(LayerNorm, MayRunInPlace) {
  Rows x = make_rows(4, 50, 1.0f, 0.0f);
  const auto expected = run_f32(x, nullptr, nullptr, 1e-5f);
  layer_norm_f32(4, 50, x.x.data(), x.stride, nullptr, nullptr, 1e-5f, x.x.data(), x.stride);
  for (int64_t row = 0; row < 4; ++row) {
    for (int64_t c = 0; c < 50; ++c) {
      EXPECT_EQ(x.x[static_cast<size_t>(row * x.stride + c)],
                expected[static_cast<size_t>(row * 50 + c)]);
    }
  }
}

TEST_P(LayerNorm, InBf16IsTheF32ResultRounded) {
  for (const int64_t channels : {5, 16, 67, 1024}) {
    const Rows x = make_rows(3, channels, 1.0f, 0.1f);
    const auto weight = random_values<float>(channels, 2), bias = random_values<float>(channels, 3);
    const auto exact = run_f32(x, weight.data(), bias.data(), 1e-5f);
    std::vector<uint16_t> y(exact.size());
    layer_norm_bf16(3, channels, x.x.data(), x.stride, weight.data(), bias.data(), 1e-5f, y.data(),
                    channels);
    for (size_t i = 0; i < y.size(); ++i) EXPECT_EQ(y[i], bfloat16_from_float(exact[i]));
  }
}

INSTANTIATE_TEST_SUITE_P(, LayerNorm, ::testing::ValuesIn(kAllCpuLevels), cpu_level_name);

TEST(LayerNormShapes, ThatCannotBeAreRefused) {
  float x[8] = {};
  EXPECT_THROW(layer_norm_f32(1, 4, x, 3, nullptr, nullptr, 1e-5f, x + 4, 4), Error);
  EXPECT_THROW(layer_norm_f32(1, 0, x, 4, nullptr, nullptr, 1e-5f, x + 4, 4), Error);
}

}  // namespace
}  // namespace vggtcd
