// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/reconstruction/child_process.h"

#include <gmock/gmock.h>

#include <fstream>
#include <iterator>

#include "tests/support/test_files.h"
#include "vggtcd/core/error.h"
#include "vggtcd/core/interrupt.h"

namespace vggtcd {
namespace {

using ::testing::HasSubstr;

std::filesystem::path fresh_log(const char* name) {
  // Of this process alone: other checkouts may run the same test now.
  static const TemporaryDirectory directory;
  const auto path = directory / name;
  std::filesystem::remove(path);
  return path;
}

std::string text_of(const std::filesystem::path& path) {
  std::ifstream file(path);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(RunProgram, ReturnsTheExitStatusAndKeepsBothOutputsInTheLog) {
  const auto log = fresh_log("run_program_status.log");
  EXPECT_EQ(run_program({"sh", "-c", "echo out; echo err >&2; exit 7"}, log, ""), 7);
  EXPECT_EQ(run_program({"sh", "-c", "echo \"$QT_QPA_PLATFORM\""}, log, ""), 0);
  EXPECT_EQ(text_of(log), "out\nerr\noffscreen\n");
}

TEST(RunProgram, ReportsASignal) {
  EXPECT_EQ(run_program({"sh", "-c", "kill -9 $$"}, fresh_log("run_program_signal.log"), ""), 137);
}

TEST(RunProgram, NamesAMissingProgramAndTheRemedy) {
  try {
    run_program({"vggtcd-no-such-program"}, fresh_log("run_program_missing.log"), "install it");
    FAIL() << "not refused";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kUnavailable);
    EXPECT_THAT(error.what(), HasSubstr("vggtcd-no-such-program"));
    EXPECT_THAT(error.what(), HasSubstr("install it"));
  }
}

TEST(RunProgram, CallsBackEvenIfTheProgramEndsAtOnce) {
  int calls = 0;
  run_program({"true"}, fresh_log("run_program_short.log"), "", [&] { ++calls; });
  EXPECT_GE(calls, 1);
}

TEST(RunProgram, EndsTheChildWhenInterrupted) {
  try {
    run_program({"sleep", "1000"}, fresh_log("run_program_interrupt.log"), "", request_interrupt);
    ADD_FAILURE() << "not interrupted";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInterrupted);
  }
  clear_interrupt();
}

}  // namespace
}  // namespace vggtcd
