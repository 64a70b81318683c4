// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/nn/linear.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <tuple>

#include "vggtcd/core/cpu_features.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/nn/conv3x3.h"
#include "vggtcd/nn/product.h"
#include "vggtcd/nn/test_support.h"

namespace vggtcd {
namespace {

// y = act(x W^T + b) in double.
std::vector<double> naive_linear(int64_t rows, int64_t in, int64_t out, const float* x,
                                 int64_t x_stride, const std::vector<float>& weight,
                                 const std::vector<float>& bias) {
  std::vector<double> y(static_cast<size_t>(rows * out));
  for (int64_t r = 0; r < rows; ++r) {
    for (int64_t o = 0; o < out; ++o) {
      double sum = bias.empty() ? 0 : bias[static_cast<size_t>(o)];
      for (int64_t i = 0; i < in; ++i) {
        sum += double{x[r * x_stride + i]} * double{weight[static_cast<size_t>(o * in + i)]};
      }
      y[static_cast<size_t>(r * out + o)] = sum;
    }
  }
  return y;
}

// Sums of `in` products of numbers of order one: f32 accumulation in any order.
double accumulation_bound(int64_t in) { return 4e-7 * static_cast<double>(in); }

void expect_near_all(const std::vector<float>& found, const std::vector<double>& expected,
                     double bound) {
  ASSERT_EQ(found.size(), expected.size());
  for (size_t i = 0; i < found.size(); ++i) {
    ASSERT_NEAR(found[i], expected[i], bound * (1 + std::abs(expected[i]))) << "at element " << i;
  }
}

// Every product that a Linear may run on: an instruction set and the numbers. Those in f32
// arithmetic; bf16 arithmetic has a test of its own.
struct Kind {
  const char* name;
  CpuLevel level;
  ProductTypes types;
};

constexpr ProductTypes kBf16Kept{DType::kF32, DType::kBF16};
constexpr Kind kKinds[] = {{"F32Reference", CpuLevel::kReference, {}},
                           {"F32Avx2", CpuLevel::kAvx2, {}},
                           {"F32Avx512", CpuLevel::kAvx512, {}},
                           {"Bf16KeptAvx2", CpuLevel::kAvx2, kBf16Kept},
                           {"Bf16KeptAvx512", CpuLevel::kAvx512, kBf16Kept}};

class LinearKinds : public ::testing::TestWithParam<Kind> {
 protected:
  void SetUp() override {
    if (GetParam().level > detected_cpu_level()) GTEST_SKIP() << "not on this processor";
    level_.emplace(GetParam().level);
  }
  ProductTypes types() const { return GetParam().types; }
  // Values of a weight as this kind keeps them.
  std::vector<float> kept(std::vector<float> weight) const {
    if (types().weights == DType::kBF16) {
      for (float& value : weight) value = float_from_bfloat16(bfloat16_from_float(value));
    }
    return weight;
  }

 private:
  std::optional<ScopedCpuLevel> level_;
};

std::string kind_name(const ::testing::TestParamInfo<Kind>& kind) { return kind.param.name; }

INSTANTIATE_TEST_SUITE_P(All, LinearKinds, ::testing::ValuesIn(kKinds), kind_name);

struct Shape {
  int64_t rows, in, out;
};

TEST_P(LinearKinds, MatchesNaiveLoopsWithGapsBetweenRows) {
  // Odd sizes, the network's, and those around the vectors, panels and blocks of the kernels.
  for (const auto& [rows, in, out] : {Shape{1, 1, 1},
                                      {1, 9, 256},
                                      {5, 256, 9},
                                      {127, 588, 33},
                                      {128, 64, 192},
                                      {42, 128, 384},
                                      {3, 1024, 2},
                                      {4, 161, 7},
                                      {9, 160, 23},
                                      {8, 255, 24},
                                      {7, 257, 25},
                                      {6, 321, 47},
                                      {17, 513, 48},
                                      {2, 20, 49},
                                      {11, 159, 72},
                                      {12, 320, 97}}) {
    SCOPED_TRACE(fmt::format("{} x {} x {}", rows, in, out));
    // oneDNN takes its reference loops for rows with gaps in f32, which is refused; the network has
    // none there.
    const bool any_gap = GetParam().level != CpuLevel::kAvx512 || types().weights == DType::kBF16;
    const int64_t x_stride = in + (any_gap ? 3 : 0), y_stride = out + (any_gap ? 5 : 0);
    const auto weight = random_values<float>(in * out, 1), bias = random_values<float>(out, 2);
    auto x = random_values<float>(rows * x_stride, 3);
    std::vector<float> y(static_cast<size_t>(rows * y_stride), -7.0f);
    const Linear linear(weight, bias, in, out, {.types = types()});
    linear.run(rows, Rows(x.data(), x_stride), Rows(y.data(), y_stride));
    const auto expected = naive_linear(rows, in, out, x.data(), x_stride, kept(weight), bias);
    for (int64_t r = 0; r < rows; ++r) {
      const auto row = y.begin() + r * y_stride;
      expect_near_all({row, row + out},
                      {expected.begin() + r * out, expected.begin() + (r + 1) * out},
                      accumulation_bound(in));
      for (int64_t gap = out; gap < y_stride; ++gap) ASSERT_EQ(row[gap], -7.0f);
    }
  }
}

TEST_P(LinearKinds, GeluIsTheExactOne) {
  // The tanh approximation is off by up to 5e-4, this bound is 250 times smaller.
  const std::vector<float> identity{1.0f};
  const Linear linear(identity, {}, 1, 1, {.types = types(), .activation = Activation::kGelu});
  std::vector<float> x, y(kRowBlock);
  for (int64_t i = 0; i < kRowBlock; ++i) x.push_back(-8.0f + static_cast<float>(i) * 0.125f);
  linear.run(kRowBlock, Rows(x.data(), 1), Rows(y.data(), 1));
  for (size_t i = 0; i < x.size(); ++i) {
    ASSERT_NEAR(y[i], reference::gelu<double>(x[i]), 2e-6 * (1 + std::abs(x[i]))) << x[i];
  }
}

TEST_P(LinearKinds, ReluClampsAtZero) {
  const std::vector<float> identity{1.0f};
  const Linear linear(identity, {}, 1, 1, {.types = types(), .activation = Activation::kRelu});
  std::vector<float> x{-2, -0.5f, 0, 3}, y(4);
  linear.run(4, Rows(x.data(), 1), Rows(y.data(), 1));
  EXPECT_EQ(y, (std::vector<float>{0, 0, 0, 3}));
}

TEST_P(LinearKinds, ActivationComesAfterTheWholeSum) {
  // 700 input channels are several blocks of every kernel; 30 channels fill no panel.
  const int64_t rows = 6, in = 700, out = 30;
  const auto weight = random_values<float>(in * out, 1), bias = random_values<float>(out, 2);
  auto x = random_values<float>(rows * in, 3);
  std::vector<float> y(static_cast<size_t>(rows * out));
  Linear(weight, bias, in, out, {.types = types(), .activation = Activation::kRelu})
      .run(rows, Rows(x.data(), in), Rows(y.data(), out));
  auto expected = naive_linear(rows, in, out, x.data(), in, kept(weight), bias);
  for (double& value : expected) value = std::max(value, 0.0);
  expect_near_all(y, expected, accumulation_bound(in));
}

TEST_P(LinearKinds, GammaScalesProductAndBiasAndAddsToY) {
  for (const int64_t in : {65, 600}) {
    const int64_t rows = 7, out = 52;
    const auto weight = random_values<float>(in * out, 1), bias = random_values<float>(out, 2);
    const auto gamma = random_values<float>(out, 4);
    auto x = random_values<float>(rows * in, 3), y = random_values<float>(rows * out, 5);
    auto expected = naive_linear(rows, in, out, x.data(), in, kept(weight), bias);
    for (size_t i = 0; i < expected.size(); ++i) {
      expected[i] = y[i] + gamma[i % static_cast<size_t>(out)] * expected[i];
    }
    Linear(weight, bias, in, out, {.types = types(), .gamma = gamma})
        .run(rows, Rows(x.data(), in), Rows(y.data(), out));
    expect_near_all(y, expected, accumulation_bound(in));
  }
}

TEST_P(LinearKinds, AccumulateAddsToY) {
  const int64_t rows = 3, in = 31, out = 16;
  const auto weight = random_values<float>(in * out, 1);
  auto x = random_values<float>(rows * in, 3), y = random_values<float>(rows * out, 5);
  auto expected = naive_linear(rows, in, out, x.data(), in, kept(weight), {});
  for (size_t i = 0; i < expected.size(); ++i) expected[i] += y[i];
  Linear(weight, {}, in, out, {.types = types(), .accumulate = true})
      .run(rows, Rows(x.data(), in), Rows(y.data(), out));
  expect_near_all(y, expected, accumulation_bound(in));
}

TEST_P(LinearKinds, WeightsKeptInBf16TakeHalfTheMemory) {
  const int64_t in = 1024, out = 1024;
  const auto weight = random_values<float>(in * out, 1);
  const auto packed =
      static_cast<double>(Linear(weight, {}, in, out, {.types = types()}).packed_bytes());
  const auto exact = static_cast<double>(bytes_of(types().weights, in, out));
  EXPECT_GE(packed, exact);
  EXPECT_LE(packed, 1.05 * exact);
}

TEST(PanelProduct, BitsOfARowDoNotDependOnTheRowsAroundIt) {
  if (cpu_level() < CpuLevel::kAvx2) GTEST_SKIP() << "the panel kernel needs AVX2";
  const int64_t in = 700, out = 50;
  const auto weight = random_values<float>(in * out, 1);
  auto x = random_values<float>(kRowBlock * in, 3);
  const Linear linear(weight, {}, in, out, {.types = kBf16Kept});
  std::vector<float> together(static_cast<size_t>(kRowBlock * out)), alone(together.size());
  linear.run(kRowBlock, Rows(x.data(), in), Rows(together.data(), out));
  for (int64_t row = 0; row < kRowBlock; ++row) {
    linear.run(1, Rows(x.data() + row * in, in), Rows(alone.data() + row * out, out));
  }
  EXPECT_EQ(together, alone);
}

TEST(Linear, Bf16OperandsWithF32SumsGiveTheProductOfTheRoundedNumbers) {
  if (!bf16_is_fast()) GTEST_SKIP() << "this processor has no AVX512_BF16";
  const int64_t rows = 77, in = 511, out = 100;
  auto weight = random_values<float>(in * out, 1);
  const auto bias = random_values<float>(out, 2);
  auto x = random_values<uint16_t>(rows * in, 3);
  std::vector<float> x_f32, y(static_cast<size_t>(rows * out));
  for (const uint16_t value : x) x_f32.push_back(float_from_bfloat16(value));
  Linear(weight, bias, in, out, {.types = {DType::kBF16, DType::kBF16}})
      .run(rows, Rows(x.data(), in), Rows(y.data(), out));
  for (float& value : weight) value = float_from_bfloat16(bfloat16_from_float(value));
  expect_near_all(y, naive_linear(rows, in, out, x_f32.data(), in, weight, bias),
                  accumulation_bound(in));
}

TEST(Linear, NamesTheImplementationOfItsPrimitives) {
  // Whatever runs the product of an odd shape in f32, oneDNN or not, has said so.
  const ScopedCpuLevel reference(CpuLevel::kReference);
  const std::vector<float> weight(331 * 7, 1.0f);
  std::vector<float> x(331), y(7);
  Linear(weight, {}, 331, 7, {}).run(1, Rows(x.data(), 331), Rows(y.data(), 7));
  const std::vector<std::string> lines = onednn_primitives();
  const auto with = [&](const std::string& text) {
    return std::count_if(lines.begin(), lines.end(),
                         [&](const std::string& line) { return line.starts_with(text); });
  };
  EXPECT_EQ(with("matmul 1x331x7 f32: "), 1);
  EXPECT_EQ(with("reorder 331x7 f32 to f32: "), 1);
}

TEST(Linear, WeightsOfEveryFloatingTypeMeanTheSame) {
  const int64_t in = 24, out = 40;
  const auto bf16 = random_values<uint16_t>(in * out, 1);  // exact in all four types but f16
  std::vector<float> f32;
  std::vector<double> f64;
  std::vector<uint16_t> f16;
  for (const uint16_t value : bf16) {
    const float rounded = float_from_half(half_from_float(float_from_bfloat16(value)));
    f16.push_back(half_from_float(rounded));
    f32.push_back(rounded);
    f64.push_back(rounded);
  }
  auto x = random_values<float>(in, 3);
  const auto run = [&](DType dtype, const auto& values) {
    const WeightStore store({{"weight", dtype, {out, in}, std::as_bytes(std::span(values))}},
                            "test");
    std::vector<float> y(static_cast<size_t>(out));
    Linear(store.root(), in, out, {}, false).run(1, Rows(x.data(), in), Rows(y.data(), out));
    return y;
  };
  const auto expected = run(DType::kF32, f32);
  EXPECT_EQ(run(DType::kF64, f64), expected);
  EXPECT_EQ(run(DType::kF16, f16), expected);
  std::vector<uint16_t> back;
  for (const float value : f32) back.push_back(bfloat16_from_float(value));
  std::vector<float> rounded;
  for (const uint16_t value : back) rounded.push_back(float_from_bfloat16(value));
  EXPECT_EQ(run(DType::kBF16, back), run(DType::kF32, rounded));
}

TEST(Linear, AnyWorkerMayRunIt) {
  // A layer made by one thread gives the same bits on others.
  const int64_t in = 64, out = 64;
  const auto weight = random_values<float>(in * out, 1);
  const Linear linear(weight, {}, in, out, {});
  auto x = random_values<float>(kRowBlock * in, 3);
  std::vector<float> expected(static_cast<size_t>(kRowBlock * out)), all(expected.size() * 16);
  linear.run(kRowBlock, Rows(x.data(), in), Rows(expected.data(), out));
  parallel_for(16, 1, [&](int64_t i, int64_t) {
    linear.run(kRowBlock, Rows(x.data(), in), Rows(all.data() + i * kRowBlock * out, out));
  });
  for (size_t i = 0; i < all.size(); ++i) ASSERT_EQ(all[i], expected[i % expected.size()]);
}

class Conv3x3Sizes : public ::testing::TestWithParam<std::tuple<int64_t, int64_t, int64_t>> {};

TEST_P(Conv3x3Sizes, MatchesNaiveLoops) {
  const auto [height, width, stride] = GetParam();
  const int64_t in = 5, out = 7;
  const auto weight = random_values<float>(out * in * 9, 1), bias = random_values<float>(out, 2);
  auto x = random_values<float>(height * width * in, 3);
  const WeightStore store(
      {{"weight", DType::kF32, {out, in, 3, 3}, std::as_bytes(std::span(weight))},
       {"bias", DType::kF32, {out}, std::as_bytes(std::span(bias))}},
      "test");
  const Conv3x3 conv(store.root(), in, out, stride, {});
  // PyTorch: floor((size + 2 * padding - 3) / stride) + 1
  const int64_t out_height = (height - 1) / stride + 1, out_width = (width - 1) / stride + 1;
  ASSERT_EQ(conv.out_size(height), out_height);
  std::vector<float> y(static_cast<size_t>(out_height * out_width * out));
  conv.run(height, width, Rows(x.data(), in), Rows(y.data(), out));
  std::vector<double> expected;
  for (int64_t oy = 0; oy < out_height; ++oy) {
    for (int64_t ox = 0; ox < out_width; ++ox) {
      for (int64_t o = 0; o < out; ++o) {
        double sum = bias[static_cast<size_t>(o)];
        for (int64_t ky = 0; ky < 3; ++ky) {
          for (int64_t kx = 0; kx < 3; ++kx) {
            const int64_t iy = oy * stride + ky - 1, ix = ox * stride + kx - 1;
            if (iy < 0 || iy >= height || ix < 0 || ix >= width) continue;
            for (int64_t i = 0; i < in; ++i) {
              sum += double{weight[static_cast<size_t>(((o * in + i) * 3 + ky) * 3 + kx)]} *
                     double{x[static_cast<size_t>((iy * width + ix) * in + i)]};
            }
          }
        }
        expected.push_back(sum);
      }
    }
  }
  expect_near_all(y, expected, accumulation_bound(9 * in));
}

INSTANTIATE_TEST_SUITE_P(Sizes, Conv3x3Sizes,
                         ::testing::Values(std::tuple{1, 1, 1}, std::tuple{1, 5, 2},
                                           std::tuple{6, 1, 1}, std::tuple{13, 21, 1},
                                           std::tuple{13, 21, 2}, std::tuple{12, 20, 2}));

}  // namespace
}  // namespace vggtcd
