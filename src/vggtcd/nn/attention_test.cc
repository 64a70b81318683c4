// SPDX-License-Identifier: Apache-2.0
// Attention against plain loops in double precision, at every instruction-set level.
#include "vggtcd/nn/attention.h"

#include <gmock/gmock.h>

#include <cmath>

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/nn/reference.h"
#include "vggtcd/nn/test_support.h"

namespace vggtcd {
namespace {

// q, k, v as the column blocks of one qkv product.
template <typename T>
struct Problem {
  AttentionShape shape;
  float scale;
  std::vector<T> qkv;  // [sequences * tokens, 3 * heads * head_dim]

  int64_t channels() const { return shape.heads * shape.head_dim; }
  int64_t rows() const { return shape.sequences * shape.tokens; }
};

template <typename T>
Problem<T> make_problem(const AttentionShape& shape, float qk_size, float v_size = 1) {
  Problem<T> problem{shape, 1.0f / std::sqrt(static_cast<float>(shape.head_dim)), {}};
  const int64_t channels = problem.channels();
  problem.qkv = random_values<T>(problem.rows() * 3 * channels);
  for (size_t i = 0; i < problem.qkv.size(); ++i) {
    const bool is_v = static_cast<int64_t>(i) % (3 * channels) >= 2 * channels;
    const float size = is_v ? v_size : qk_size;
    problem.qkv[i] = reference::store<T>(size * reference::load<float>(problem.qkv[i]));
  }
  return problem;
}

template <typename T>
std::vector<T> run(const Problem<T>& problem, int64_t out_padding = 0) {
  const int64_t channels = problem.channels(), stride = channels + out_padding;
  std::vector<T> padded(static_cast<size_t>(problem.rows() * stride), T{7});
  AttentionWorkspace workspace;
  const T* q = problem.qkv.data();
  if constexpr (sizeof(T) == 4) {
    attention_f32(problem.shape, q, q + channels, q + 2 * channels, 3 * channels, padded.data(),
                  stride, problem.scale, workspace);
  } else {
    attention_bf16(problem.shape, q, q + channels, q + 2 * channels, 3 * channels, padded.data(),
                   stride, problem.scale, workspace);
  }
  std::vector<T> out;
  for (int64_t row = 0; row < problem.rows(); ++row) {
    const T* begin = padded.data() + row * stride;
    out.insert(out.end(), begin, begin + channels);
    for (int64_t c = channels; c < stride; ++c) EXPECT_EQ(begin[c], T{7}) << "beyond row " << row;
  }
  return out;
}

// The result in double, and sum p |v|, what the rounding of probabilities is relative to.
struct Expected {
  std::vector<double> out, magnitude;
};

template <typename T>
Expected expect(const Problem<T>& problem) {
  const int64_t channels = problem.channels(), stride = 3 * channels, dim = problem.shape.head_dim;
  std::vector<T> magnitudes = problem.qkv;
  for (T& value : magnitudes) {
    value = reference::store<T>(std::abs(reference::load<float>(value)));
  }
  Expected expected;
  const size_t size = static_cast<size_t>(problem.rows() * channels);
  expected.out.resize(size);
  expected.magnitude.resize(size);
  std::vector<double> scores;
  for (int64_t row = 0; row < problem.rows(); ++row) {
    const int64_t first = row / problem.shape.tokens * problem.shape.tokens * stride;
    for (int64_t column = 0; column < channels; column += dim) {
      const T* q = problem.qkv.data() + row * stride + column;
      const T* k = problem.qkv.data() + first + channels + column;
      const int64_t v = first + 2 * channels + column, to = row * channels + column;
      reference::attention_row<double>(problem.shape.tokens, dim, q, k, problem.qkv.data() + v,
                                       stride, expected.out.data() + to, double{problem.scale},
                                       scores);
      reference::attention_row<double>(problem.shape.tokens, dim, q, k, magnitudes.data() + v,
                                       stride, expected.magnitude.data() + to,
                                       double{problem.scale}, scores);
    }
  }
  return expected;
}

// Sizes around every block of the kernels: a tile of keys (4, 8), lanes (8, 16), a group of queries
// (24, 48), a block of keys (64, 128), a task of queries (192).
const AttentionShape kShapes[] = {{1, 1, 1, 64},   {1, 2, 2, 64},   {3, 7, 2, 64},
                                  {2, 8, 1, 128},  {1, 9, 3, 64},   {2, 30, 2, 64},
                                  {1, 47, 1, 64},  {1, 49, 1, 128}, {1, 65, 1, 64},
                                  {2, 129, 2, 64}, {1, 193, 2, 64}, {1, 401, 1, 128}};

class Attention : public CpuLevelTest {};

TEST_P(Attention, InF32IsTheDoubleResultToFloatPrecision) {
  for (const AttentionShape& shape : kShapes) {
    SCOPED_TRACE(shape_name(shape));
    const auto problem = make_problem<float>(shape, 1.0f);
    // Scores of order one: their f32 error of some 2^-23 is what the exponent passes on.
    EXPECT_LE(relative_l2(run(problem), expect(problem).out), 1e-6);
  }
}

TEST_P(Attention, InBf16IsWithinTheRoundingOfProbabilitiesAndResult) {
  for (const AttentionShape& shape : kShapes) {
    SCOPED_TRACE(shape_name(shape));
    const auto problem = make_problem<uint16_t>(shape, 1.0f);
    const Expected expected = expect(problem);
    std::vector<double> bound(expected.out.size());
    for (size_t i = 0; i < bound.size(); ++i) {
      // Half a unit in the last of bf16's 8 bits, for probabilities (in the sum over values and in
      // the sum they are divided by) and for the result; 2e-4 for the polynomial of the exponential
      // and the f32 arithmetic.
      const double out = std::abs(expected.out[i]);
      bound[i] = (0x1p-8 + 2e-4) * (expected.magnitude[i] + out) + 0x1p-8 * out;
    }
    expect_within(run(problem), expected.out, bound);
  }
}

TEST_P(Attention, PicksTheBestKeyWhereScoresAreHuge) {
  // Scores of some +-1e4: exp of anything but the differences would overflow, and most
  // probabilities underflow.
  for (const AttentionShape& shape :
       {AttentionShape{1, 150, 2, 64}, AttentionShape{2, 31, 1, 128}}) {
    SCOPED_TRACE(shape_name(shape));
    const auto problem = make_problem<float>(shape, 100.0f);
    // The exponent carries the absolute error of scores: 64 * 100^2 * 2^-24 or so.
    EXPECT_LE(relative_l2(run(problem), expect(problem).out), 2e-3);
  }
}

TEST_P(Attention, WithEqualKeysIsTheMeanOfTheValues) {
  const AttentionShape shape{1, 333, 1, 64};
  auto problem = make_problem<float>(shape, 0.0f);
  const Expected expected = expect(problem);
  EXPECT_LE(relative_l2(run(problem), expected.out), 1e-6);
  double mean = 0;
  for (int64_t row = 0; row < 333; ++row) {
    mean += double{problem.qkv[static_cast<size_t>(row * 192 + 128 + 5)]} / 333;
  }
  EXPECT_NEAR(expected.out[5], mean, 1e-12);
}

// Scores that rise, fall or jump from key to key: the running maximum is raised at every tile,
// once, or in the middle of a block, by little or by thousands.
TEST_P(Attention, DoesNotDependOnTheOrderInWhichLargeScoresCome) {
  const AttentionShape shape{1, 300, 1, 64};
  const auto with_scores = [&](auto score) {
    auto problem = make_problem<float>(shape, 0.0f);
    for (int64_t row = 0; row < shape.tokens; ++row) {
      float* q = problem.qkv.data() + row * 192;
      q[0] = 8;  // undoes the scale
      q[64] = score(row);
    }
    return problem;
  };
  const std::vector<Problem<float>> problems = {
      with_scores([](int64_t i) { return static_cast<float>(i); }),
      with_scores([](int64_t i) { return static_cast<float>(-i); }),
      with_scores([](int64_t i) { return 30.0f * static_cast<float>(i); }),
      with_scores([](int64_t i) { return i == 299 ? 5000.0f : 0.0f; }),
      with_scores([](int64_t i) { return i == 100 ? 40.0f : 0.01f * static_cast<float>(i % 7); }),
      with_scores([](int64_t i) { return -1e6f - static_cast<float>(i % 5); }),
      with_scores([](int64_t i) { return i % 2 ? -1e9f : -1e9f * 3; }),
      with_scores([](int64_t i) { return i < 5 ? 1.0f : -3e28f; }),
      // Minus infinity in f32, a probability of 0 either way.
      with_scores([](int64_t i) { return i % 7 == 2 ? 1.0f : -3e38f; })};
  for (const auto& problem : problems) {
    EXPECT_LE(relative_l2(run(problem), expect(problem).out), 2e-6);
  }
}

TEST_P(Attention, KeepsTinyAndLargeValuesInProportion) {
  for (const float v_size : {1e-30f, 1e30f}) {
    const auto problem = make_problem<float>({1, 77, 1, 64}, 1.0f, v_size);
    EXPECT_LE(relative_l2(run(problem), expect(problem).out), 1e-6);
  }
}

TEST_P(Attention, PassesOnNaN) {
  auto problem = make_problem<float>({1, 20, 1, 64}, 1.0f);
  problem.qkv[3] = NAN;  // the first query
  const auto out = run(problem);
  for (int64_t c = 0; c < 64; ++c) EXPECT_TRUE(std::isnan(out[static_cast<size_t>(c)]));
  for (size_t i = 64; i < out.size(); ++i) EXPECT_FALSE(std::isnan(out[i]));
}

TEST_P(Attention, WritesOnlyItsColumnsOfTheOutputRows) {
  const auto problem = make_problem<float>({2, 50, 2, 64}, 1.0f);
  EXPECT_EQ(run(problem, 6), run(problem));
}

TEST_P(Attention, HasTheSameBitsForAnyNumberOfThreads) {
  const auto f32 = make_problem<float>({2, 500, 2, 64}, 1.0f);
  const auto bf16 = make_problem<uint16_t>({2, 500, 2, 64}, 1.0f);
  const int threads = num_threads();
  set_num_threads(1);
  const auto f32_alone = run(f32);
  const auto bf16_alone = run(bf16);
  for (const int count : {2, 5}) {
    set_num_threads(count);
    EXPECT_EQ(run(f32), f32_alone);
    EXPECT_EQ(run(bf16), bf16_alone);
  }
  set_num_threads(threads);
}

TEST_P(Attention, ReusesAWorkspaceThatSawALargerShape) {
  AttentionWorkspace workspace;
  const auto large = make_problem<float>({1, 300, 2, 64}, 1.0f);
  const auto small = make_problem<float>({1, 20, 2, 64}, 1.0f);
  std::vector<float> out(300 * 128);
  for (const auto* problem : {&large, &small}) {
    const float* q = problem->qkv.data();
    attention_f32(problem->shape, q, q + 128, q + 256, 384, out.data(), 128, problem->scale,
                  workspace);
  }
  out.resize(20 * 128);
  EXPECT_EQ(out, run(small));
}

TEST_P(Attention, TakesMemoryLinearInTokens) {
  const size_t one = attention_workspace_bytes({1, 100000, 16, 64}, false);
  const size_t two = attention_workspace_bytes({1, 200000, 16, 64}, false);
  EXPECT_LE(two, 2 * one);
  EXPECT_LE(two, size_t{200000} * 64 * 4 * 2 + (size_t{1} << 22));
}

INSTANTIATE_TEST_SUITE_P(, Attention, ::testing::ValuesIn(kAllCpuLevels), cpu_level_name);

TEST(AttentionShapes, ThatCannotBeAreRefused) {
  float x[256] = {};
  AttentionWorkspace workspace;
  const auto call = [&](const AttentionShape& shape, int64_t stride, float scale) {
    attention_f32(shape, x, x, x, stride, x + 128, stride, scale, workspace);
  };
  EXPECT_THROW(call({1, 1, 1, 63}, 64, 1), Error);
  EXPECT_THROW(call({1, 1, 2, 64}, 64, 1), Error);
  EXPECT_THROW(call({1, 1, 1, 64}, 64, 0), Error);
  EXPECT_THROW(call({1, -1, 1, 64}, 64, 1), Error);
  EXPECT_NO_THROW(call({0, 5, 1, 64}, 64, 1));
}

}  // namespace
}  // namespace vggtcd
