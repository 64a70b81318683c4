// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/core/timer.h"

#include <gtest/gtest.h>

#include <vector>

namespace vggtcd {
namespace {

TEST(PeakMemory, GrowsByWhatIsTouched) {
  const int64_t before = peak_memory_bytes();
  const int64_t resident = resident_memory_bytes();
  ASSERT_GT(before, 0);
  const int64_t slack = before - resident;
  const std::vector<char> block(static_cast<size_t>(64 << 20) + static_cast<size_t>(slack), 1);
  EXPECT_GE(peak_memory_bytes(), before + (60 << 20));
  EXPECT_EQ(block.back(), 1);
}

TEST(AvailableMemory, IsPositive) { EXPECT_GT(available_memory_bytes(), 0); }

TEST(MonotonicSeconds, DoesNotGoBackwards) {
  const double first = monotonic_seconds();
  EXPECT_GE(monotonic_seconds(), first);
}

}  // namespace
}  // namespace vggtcd
