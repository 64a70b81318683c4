// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/core/cpu_features.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <string>

#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

// What the kernel says this processor has: a source other than CPUID itself.
bool kernel_lists(const std::string& flag) {
  std::ifstream file("/proc/cpuinfo");
  std::string line;
  while (std::getline(file, line)) {
    if (line.starts_with("flags")) return (line + " ").find(" " + flag + " ") != std::string::npos;
  }
  return false;
}

TEST(CpuLevel, DetectedLevelAgreesWithTheKernel) {
  const bool avx2 = kernel_lists("avx2") && kernel_lists("fma") && kernel_lists("f16c");
  const bool avx512 = avx2 && kernel_lists("avx512f") && kernel_lists("avx512bw") &&
                      kernel_lists("avx512dq") && kernel_lists("avx512vl");
  const bool bf16 = avx512 && kernel_lists("avx512_bf16");
  EXPECT_EQ(detected_cpu_level() >= CpuLevel::kAvx2, avx2);
  EXPECT_EQ(detected_cpu_level() >= CpuLevel::kAvx512, avx512);
  EXPECT_EQ(detected_cpu_level() >= CpuLevel::kAvx512Bf16, bf16);
}

TEST(CpuLevel, ScopesNestAndRestore) {
  const CpuLevel before = cpu_level();
  {
    const ScopedCpuLevel outer(CpuLevel::kReference);
    EXPECT_EQ(cpu_level(), CpuLevel::kReference);
    {
      const ScopedCpuLevel inner(detected_cpu_level());
      EXPECT_EQ(cpu_level(), detected_cpu_level());
    }
    EXPECT_EQ(cpu_level(), CpuLevel::kReference);
  }
  EXPECT_EQ(cpu_level(), before);
}

TEST(CpuLevel, CannotBeForcedBeyondTheProcessor) {
  if (detected_cpu_level() == CpuLevel::kAvx512Bf16) GTEST_SKIP() << "has every level";
  EXPECT_THROW(ScopedCpuLevel{CpuLevel::kAvx512Bf16}, Error);
}

// The variable is read once in a process: in a child that has not yet asked. EXPECT_EXIT forks.
void exit_with_level_for(const char* value) {
  ::setenv("VGGTCD_ISA", value, 1);
  try {
    std::exit(10 + static_cast<int>(cpu_level()));
  } catch (const Error& error) {
    std::exit(static_cast<int>(error.code()));
  }
}

TEST(CpuLevelDeathTest, EnvironmentLowersIt) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(exit_with_level_for("reference"), ::testing::ExitedWithCode(10), "");
  if (detected_cpu_level() >= CpuLevel::kAvx2) {
    EXPECT_EXIT(exit_with_level_for("avx2"), ::testing::ExitedWithCode(11), "");
  }
}

TEST(CpuLevelDeathTest, EnvironmentWithAnUnknownNameIsAUsageError) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(exit_with_level_for("sse9"), ::testing::ExitedWithCode(2), "");
}

}  // namespace
}  // namespace vggtcd
