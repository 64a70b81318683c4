// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/core/parallel.h"

#include <gmock/gmock.h>
#include <sys/resource.h>

#include <atomic>
#include <cstdlib>
#include <numeric>
#include <vector>

#include "vggtcd/core/error.h"
#include "vggtcd/core/interrupt.h"

namespace vggtcd {
namespace {

class ParallelFor : public ::testing::TestWithParam<int> {
 protected:
  void SetUp() override { set_num_threads(GetParam()); }
  void TearDown() override {
    clear_interrupt();
    set_num_threads(2);
  }
};

TEST_P(ParallelFor, VisitsEveryIndexOnce) {
  for (const int64_t size : {0, 1, 7, 64, 1000}) {
    std::vector<std::atomic<int>> visits(static_cast<size_t>(size));
    parallel_for(size, 8, [&](int64_t begin, int64_t end) {
      for (int64_t i = begin; i < end; ++i) ++visits[static_cast<size_t>(i)];
    });
    for (const auto& count : visits) EXPECT_EQ(count, 1);
  }
}

TEST_P(ParallelFor, ChunkSumsInChunkOrderHaveTheBitsOfOneThread) {
  constexpr int64_t kSize = 10007, kGrain = 100;
  std::vector<float> partial(static_cast<size_t>(num_chunks(kSize, kGrain)));
  parallel_for(kSize, kGrain, [&](int64_t begin, int64_t end) {
    float sum = 0;
    for (int64_t i = begin; i < end; ++i) sum += 1.0f / static_cast<float>(i + 1);
    partial[static_cast<size_t>(begin / kGrain)] = sum;
  });
  float expected = 0;
  for (int64_t begin = 0; begin < kSize; begin += kGrain) {
    float sum = 0;
    for (int64_t i = begin; i < std::min(kSize, begin + kGrain); ++i) {
      sum += 1.0f / static_cast<float>(i + 1);
    }
    expected += sum;
  }
  EXPECT_EQ(std::accumulate(partial.begin(), partial.end(), 0.0f), expected);
}

TEST_P(ParallelFor, ThrowsTheErrorOfAChunkAndStaysUsable) {
  EXPECT_THROW(parallel_for(100, 1,
                            [](int64_t begin, int64_t) {
                              if (begin == 50) throw_error(ErrorCode::kInput, "chunk {}", begin);
                            }),
               Error);
  std::atomic<int> count{0};
  parallel_for(10, 1, [&](int64_t, int64_t) { ++count; });
  EXPECT_EQ(count, 10);
}

TEST_P(ParallelFor, StopsWhenInterrupted) {
  std::atomic<int> count{0};
  try {
    parallel_for(1000, 1, [&](int64_t, int64_t) {
      if (++count == 3) request_interrupt();
    });
    FAIL() << "not interrupted";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInterrupted);
  }
  EXPECT_LT(count, 1000);
}

TEST_P(ParallelFor, NestedLoopsRunSeriallyAndWorkersStayInRange) {
  std::atomic<int> count{0};
  parallel_for_workers(4, 1, [&](int64_t, int64_t, int worker) {
    EXPECT_GE(worker, 0);
    EXPECT_LT(worker, num_threads());
    parallel_for(5, 1, [&](int64_t, int64_t) { ++count; });
  });
  EXPECT_EQ(count, 20);
}

INSTANTIATE_TEST_SUITE_P(Threads, ParallelFor, ::testing::Values(1, 2, 5));

// GCC tells by a macro that a sanitizer is on, clang by a feature.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define VGGTCD_SANITIZED 1
#elif defined(__has_feature)
#define VGGTCD_SANITIZED (__has_feature(address_sanitizer) || __has_feature(thread_sanitizer))
#else
#define VGGTCD_SANITIZED 0
#endif

// With little address space, which stands for any limit: the stacks of a thousand threads take 8
// GB. Exits with 0 if a loop works on fewer threads than were asked for, but on more than one.
[[noreturn]] void work_where_threads_are_short() {
  const rlimit limit{rlim_t{1} << 30, rlim_t{1} << 30};
  if (setrlimit(RLIMIT_AS, &limit) != 0) std::_Exit(2);
  constexpr int kAsked = 1000;
  set_num_threads(kAsked);
  const int given = start_threads();
  if (given >= kAsked || given < 2 || num_threads() != given) std::_Exit(3);
  std::vector<std::atomic<int>> visits(5000);
  parallel_for_workers(5000, 1, [&](int64_t begin, int64_t, int worker) {
    if (worker < given) ++visits[static_cast<size_t>(begin)];
  });
  for (const auto& count : visits) {
    if (count != 1) std::_Exit(4);
  }
  set_num_threads(1);  // ends them
  std::_Exit(0);
}

TEST(StartThreads, GoesOnWithThoseThatTheSystemGives) {
#if VGGTCD_SANITIZED
  GTEST_SKIP() << "a sanitizer needs its address space";
#endif
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(work_where_threads_are_short(), ::testing::ExitedWithCode(0), "");
}

TEST(StartThreads, SaysHowManyWork) {
  set_num_threads(3);
  EXPECT_EQ(start_threads(), 3);
  EXPECT_EQ(num_threads(), 3);
  set_num_threads(1);
  EXPECT_EQ(start_threads(), 1);
  set_num_threads(2);
}

TEST(SetNumThreads, RefusesZero) { EXPECT_THROW(set_num_threads(0), Error); }

}  // namespace
}  // namespace vggtcd
