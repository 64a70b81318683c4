// SPDX-License-Identifier: Apache-2.0
// For this room's tests: every instruction-set level as a parameter, random numbers, comparison
// with a double-precision result.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "vggtcd/core/cpu_features.h"
#include "vggtcd/nn/attention.h"
#include "vggtcd/nn/reference.h"

namespace vggtcd {

inline constexpr CpuLevel kAllCpuLevels[] = {CpuLevel::kReference, CpuLevel::kAvx2,
                                             CpuLevel::kAvx512, CpuLevel::kAvx512Bf16};

inline std::string cpu_level_name(const ::testing::TestParamInfo<CpuLevel>& info) {
  return std::string(enum_to_string(info.param));
}

// Runs each test at the level that is its parameter; skips those that this processor lacks.
class CpuLevelTest : public ::testing::TestWithParam<CpuLevel> {
 protected:
  void SetUp() override {
    if (GetParam() > detected_cpu_level()) {
      GTEST_SKIP() << "this processor has no " << enum_to_string(GetParam());
    }
    level_.emplace(GetParam());
  }
  void TearDown() override { level_.reset(); }

 private:
  std::optional<ScopedCpuLevel> level_;
};

// Standard normal numbers, always the same ones.
template <typename T>
std::vector<T> random_values(int64_t count, unsigned seed = 1) {
  std::mt19937 generator(seed);
  std::normal_distribution<float> normal;
  std::vector<T> values(static_cast<size_t>(count));
  for (T& value : values) value = reference::store<T>(normal(generator));
  return values;
}

inline std::string shape_name(const AttentionShape& shape) {
  return fmt::format("{} sequences of {} tokens, {} heads of {}", shape.sequences, shape.tokens,
                     shape.heads, shape.head_dim);
}

// |actual - expected| / |expected|, Euclidean norms.
template <typename T>
double relative_l2(const std::vector<T>& actual, const std::vector<double>& expected) {
  EXPECT_EQ(actual.size(), expected.size());
  double difference = 0, norm = 0;
  for (size_t i = 0; i < expected.size(); ++i) {
    const double error = reference::load<double>(actual[i]) - expected[i];
    difference += error * error;
    norm += expected[i] * expected[i];
  }
  return std::sqrt(difference / norm);
}

// Every |actual - expected| <= bound; reports the worst offender. NaN offends.
template <typename T>
void expect_within(const std::vector<T>& actual, const std::vector<double>& expected,
                   const std::vector<double>& bound) {
  ASSERT_EQ(actual.size(), expected.size());
  size_t worst = 0, offenders = 0;
  double worst_ratio = 0;
  for (size_t i = 0; i < expected.size(); ++i) {
    const double error = std::abs(reference::load<double>(actual[i]) - expected[i]);
    if (error <= bound[i]) continue;
    ++offenders;
    if (!(error / bound[i] <= worst_ratio)) {
      worst_ratio = error / bound[i];
      worst = i;
    }
  }
  EXPECT_EQ(offenders, 0u) << "worst at " << worst << ": expected " << expected[worst]
                           << ", actual " << reference::load<double>(actual[worst]) << ", bound "
                           << bound[worst];
}

}  // namespace vggtcd
