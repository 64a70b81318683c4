// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/foreign_lines.h"

#include <gmock/gmock.h>

#include <cstdio>
#include <iostream>
#include <thread>

namespace vggtcd {
namespace {

using ::testing::ElementsAre;

TEST(ForeignLines, KeepWhatTheThreadPrintsAndNothingElse) {
  ::testing::internal::CaptureStderr();
  std::fprintf(stderr, "before\n");
  {
    const ForeignLines foreign;
    std::fprintf(stderr, "from %s\n", "C");
    std::cerr << "from C++ " << 1 << std::endl;
    std::thread([] { std::fprintf(stderr, "from another thread\n"); }).join();
    {
      const ForeignLines inner;
      std::fputs("nested\n", stderr);
      EXPECT_THAT(inner.lines(), ElementsAre("nested"));
    }
    EXPECT_THAT(foreign.lines(), ElementsAre("from C", "from C++ 1"));
  }
  std::fprintf(stderr, "after\n");
  std::cerr << "at the end\n";
  EXPECT_EQ(::testing::internal::GetCapturedStderr(),
            "before\nfrom another thread\nafter\nat the end\n");
}

TEST(ForeignLines, LoseWhatALoggerPutsBeforeThemAndRepetitions) {
  const ForeignLines foreign;
  std::fputs("[ WARN:0@0.013] bad tag\r\n\nline\n[ WARN:1@7.2] bad tag\nline\nlast", stderr);
  EXPECT_THAT(foreign.lines(), ElementsAre("bad tag", "line", "last"));
}

TEST(ForeignLines, AreBounded) {
  const ForeignLines foreign;
  for (int i = 0; i < 100000; ++i) std::fprintf(stderr, "line %d\n", i);
  EXPECT_LE(foreign.text().size(), 16384u);
}

}  // namespace
}  // namespace vggtcd
