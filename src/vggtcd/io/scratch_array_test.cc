// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/scratch_array.h"

#include <gmock/gmock.h>

#include <numeric>
#include <vector>

#include "tests/support/test_files.h"
#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"

namespace vggtcd {
namespace {

TEST(ScratchArray, PartsWrittenInAnyOrderByManyThreadsReadBackAsOne) {
  const TemporaryDirectory directory;
  ScratchArray<float> array(directory.path());
  constexpr int64_t kParts = 50;
  constexpr size_t kPart = 1000;
  parallel_for(kParts, 1, [&](int64_t part, int64_t) {
    const size_t first = static_cast<size_t>(kParts - 1 - part) * kPart;
    std::vector<float> values(kPart);
    std::iota(values.begin(), values.end(), static_cast<float>(first));
    array.write(first, values);
  });
  std::vector<float> all(kParts * kPart), expected(kParts * kPart);
  array.read(0, all);
  std::iota(expected.begin(), expected.end(), 0.0f);
  EXPECT_EQ(all, expected);
  std::vector<float> some(3);
  array.read(1234, some);
  EXPECT_THAT(some, testing::ElementsAre(1234, 1235, 1236));
}

TEST(ScratchArray, LeavesNoNameInTheDirectory) {
  const TemporaryDirectory directory;
  ScratchArray<float> array(directory.path());
  array.write(0, std::vector<float>(10, 1.0f));
  EXPECT_TRUE(std::filesystem::is_empty(directory.path()));
}

TEST(ScratchArray, AMissingDirectoryIsNamed) {
  const TemporaryDirectory directory;
  EXPECT_ERROR(ScratchArray<float>(directory / "gone"), ErrorCode::kOutput,
               "gone: temporary data cannot be written");
}

TEST(ScratchArray, WhatDoesNotFitIsAnErrorNotLostData) {
  const TemporaryDirectory directory;
  ScratchFile file(directory.path());
  const std::vector<std::byte> one(1);
  EXPECT_ERROR(file.write(uint64_t{1} << 62, one), ErrorCode::kOutput, "cannot be written");
}

}  // namespace
}  // namespace vggtcd
