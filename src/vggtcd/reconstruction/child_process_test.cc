// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/reconstruction/child_process.h"

#include <gmock/gmock.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
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
  const ProgramEnd end = run_program({"sh", "-c", "echo out; echo err >&2; exit 7"}, log, "");
  EXPECT_EQ(end.status, 7);
  EXPECT_EQ(end.signal, 0);
  EXPECT_EQ(end.in_words(), "exit status 7");
  EXPECT_TRUE(run_program({"sh", "-c", "echo \"$QT_QPA_PLATFORM\""}, log, "").succeeded());
  EXPECT_EQ(text_of(log), "out\nerr\noffscreen\n");
}

TEST(RunProgram, TellsASignalFromAnExitStatus) {
  const auto log = fresh_log("run_program_signal.log");
  const ProgramEnd killed = run_program({"sh", "-c", "kill -9 $$"}, log, "");
  EXPECT_EQ(killed.signal, SIGKILL);
  EXPECT_FALSE(killed.succeeded());
  EXPECT_THAT(killed.in_words(), HasSubstr("signal 9 (Killed), as when memory is short"));
  const ProgramEnd exited = run_program({"sh", "-c", "exit 137"}, log, "");
  EXPECT_EQ(exited.signal, 0);
  EXPECT_EQ(exited.status, 137);
}

TEST(RunProgram, NamesAProgramThatCannotBeStarted) {
  const auto folder = std::filesystem::path(::testing::TempDir()) / "run_program_no_format";
  std::filesystem::create_directory(folder);
  const auto program = folder / "vggtcd-no-program";
  std::ofstream(program) << std::string("\x7f", 1) << "ELF";
  std::filesystem::permissions(program, std::filesystem::perms::owner_all);
  const std::string path = std::getenv("PATH");
  setenv("PATH", (folder.string() + ":" + path).c_str(), 1);
  try {
    run_program({"vggtcd-no-program"}, fresh_log("run_program_no_format.log"), "install it");
    ADD_FAILURE() << "not refused";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kUnavailable);
    EXPECT_THAT(error.what(), HasSubstr("vggtcd-no-program: cannot be started; install it"));
  }
  setenv("PATH", path.c_str(), 1);
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
