// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/output_directory.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/ptrace.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <functional>

#include "tests/support/test_files.h"
#include "vggtcd/io/output_file.h"
#include "vggtcd/io/partial_directory.h"

namespace vggtcd {
namespace {

namespace fs = std::filesystem;

OutputContents contents() { return {kResultsKind, {"a.txt", "b.txt", "overlays/"}}; }

void write_results(const fs::path& target, std::string_view text) {
  OutputDirectory out(target, contents());
  write_text_file(out / "a.txt", text);
  write_text_file(out.subdirectory("overlays/before") / "b.txt", text);
  EXPECT_TRUE(!fs::exists(target / "a.txt") || file_bytes(target / "a.txt") != text);
  out.commit();
}

// The visible ones.
std::vector<std::string> entries(const fs::path& directory) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(directory)) {
    const std::string name = entry.path().filename().string();
    if (name.front() != '.') names.push_back(name);
  }
  std::ranges::sort(names);
  return names;
}

size_t hidden(const fs::path& directory) {
  const auto all = std::distance(fs::directory_iterator(directory), fs::directory_iterator());
  return static_cast<size_t>(all) - entries(directory).size();
}

using Names = std::vector<std::string>;

TEST(OutputDirectory, AppearsOnCommitWithEverything) {
  const TemporaryDirectory directory;
  write_results(directory / "out", "one");
  EXPECT_EQ(file_bytes(directory / "out/a.txt"), "one");
  EXPECT_EQ(file_bytes(directory / "out/overlays/before/b.txt"), "one");
  EXPECT_EQ(entries(directory / "out"), (Names{"a.txt", "overlays"}));
  EXPECT_EQ(hidden(directory / "out"), 1u);  // the list
  EXPECT_EQ(directory.num_files(), 1u);
}

TEST(OutputDirectory, WithoutCommitLeavesNothing) {
  const TemporaryDirectory directory;
  fs::create_directory(directory / "empty");
  for (const char* target : {"new/parents/out", "empty"}) {
    OutputDirectory out(directory / target, contents());
    write_text_file(out / "a.txt", "x");
  }
  EXPECT_EQ(directory.num_files(), 1u);
  EXPECT_EQ(hidden(directory / "empty"), 0u);
  EXPECT_EQ(entries(directory / "empty"), Names{});
}

TEST(OutputDirectory, ReplacesWhatAnEarlierRunListedAndNothingElse) {
  const TemporaryDirectory directory;
  {
    OutputDirectory out(directory / "out", contents());
    for (const char* name : {"a.txt", "b.txt", "overlays/old/1.png", "overlays/both/1.png"}) {
      write_text_file(
          out.subdirectory(fs::path(name).parent_path().string()) / fs::path(name).filename(),
          "one");
    }
    out.commit();
  }
  write_bytes(directory / "out/notes.txt", "of the user");
  write_bytes(directory / "out/overlays/both/notes.txt", "of the user");
  fs::create_directories(directory / "out/monday/empty");
  write_bytes(directory / "out/monday/photo.jpg", "precious");
  {
    OutputDirectory out(directory / "out/", contents());
    write_text_file(out / "a.txt", "two");
    write_text_file(out.subdirectory("overlays/both") / "1.png", "two");
    write_text_file(out.subdirectory("overlays/new") / "1.png", "two");
    EXPECT_EQ(file_bytes(directory / "out/a.txt"), "one");
    out.commit();
  }
  EXPECT_EQ(file_bytes(directory / "out/a.txt"), "two");
  EXPECT_EQ(file_bytes(directory / "out/overlays/both/1.png"), "two");
  EXPECT_EQ(entries(directory / "out"), (Names{"a.txt", "monday", "notes.txt", "overlays"}));
  EXPECT_EQ(entries(directory / "out/overlays"), (Names{"both", "new"}));  // old/ is empty now
  EXPECT_EQ(file_bytes(directory / "out/overlays/both/notes.txt"), "of the user");
  EXPECT_EQ(file_bytes(directory / "out/notes.txt"), "of the user");
  EXPECT_EQ(file_bytes(directory / "out/monday/photo.jpg"), "precious");
  EXPECT_TRUE(fs::is_directory(directory / "out/monday/empty"));
  EXPECT_EQ(hidden(directory / "out"), 1u);
  EXPECT_EQ(directory.num_files(), 1u);
}

TEST(OutputDirectory, AFailedRunLeavesTheResultsOfTheOneBefore) {
  const TemporaryDirectory directory;
  write_results(directory / "out", "one");
  {
    OutputDirectory failed(directory / "out", contents());
    write_text_file(failed / "a.txt", "two");
  }
  EXPECT_EQ(file_bytes(directory / "out/a.txt"), "one");
  write_results(directory / "out", "three");  // they are still its own
  EXPECT_EQ(file_bytes(directory / "out/a.txt"), "three");
}

TEST(OutputDirectory, WhatWasChangedSinceIsNobodysToReplace) {
  const TemporaryDirectory directory;
  write_results(directory / "out", "one");
  write_bytes(directory / "out/overlays/before/b.txt", "annotated");
  EXPECT_ERROR(OutputDirectory(directory / "out", contents()), ErrorCode::kOutput,
               "out/overlays/before/b.txt: stands where results go, and is not as vggt-cd wrote it "
               "there; move it away, or name another directory");
  EXPECT_ERROR(OutputDirectory::check_usable(directory / "out", contents()), ErrorCode::kOutput,
               "stands where results go");
  // In the way of nothing it stays.
  OutputDirectory out(directory / "out", {kResultsKind, {"a.txt"}});
  write_text_file(out / "a.txt", "two");
  out.commit();
  EXPECT_EQ(file_bytes(directory / "out/overlays/before/b.txt"), "annotated");
  EXPECT_EQ(file_bytes(directory / "out/a.txt"), "two");
}

TEST(OutputDirectory, NamesWhatStandsInTheWay) {
  const TemporaryDirectory directory;
  fs::create_directory(directory / "out");
  write_bytes(directory / "out/.vggt-cd-results", "");
  write_bytes(directory / "out/b.txt", "precious");
  EXPECT_ERROR(OutputDirectory(directory / "out", contents()), ErrorCode::kOutput, "out/b.txt: ");
  fs::remove(directory / "out/b.txt");
  fs::create_directory(directory / "out/b.txt");
  EXPECT_ERROR(OutputDirectory(directory / "out", contents()), ErrorCode::kOutput, "out/b.txt: ");
  fs::remove(directory / "out/b.txt");
  fs::create_symlink("nowhere", directory / "out/b.txt");
  EXPECT_ERROR(OutputDirectory(directory / "out", contents()), ErrorCode::kOutput, "out/b.txt: ");
  fs::remove(directory / "out/b.txt");
  fs::create_directory(directory / "elsewhere");
  fs::create_directory_symlink(directory / "elsewhere", directory / "out/overlays");
  EXPECT_ERROR(OutputDirectory(directory / "out", contents()), ErrorCode::kOutput,
               "out/overlays: ");
  fs::remove(directory / "out/overlays");
  EXPECT_EQ(hidden(directory / "out"), 1u);
  write_results(directory / "out", "one");
}

TEST(OutputDirectory, AddsToWhatIsThere) {
  const TemporaryDirectory directory;
  write_results(directory / "out", "one");
  for (const char* text : {"two", "three"}) {
    OutputDirectory out(directory / "out", {kResultsKind, {"b.txt"}, true});
    write_text_file(out / "b.txt", text);
    out.commit();
    EXPECT_EQ(file_bytes(directory / "out/b.txt"), text);
  }
  EXPECT_EQ(entries(directory / "out"), (Names{"a.txt", "b.txt", "overlays"}));
  write_results(directory / "out", "four");  // all of it is listed
  EXPECT_EQ(entries(directory / "out"), (Names{"a.txt", "overlays"}));
}

TEST(OutputDirectory, OneKindDoesNotReplaceAnother) {
  const TemporaryDirectory directory;
  write_results(directory / "out", "one");
  EXPECT_ERROR(OutputDirectory(directory / "out", {"scene", {"truth.npz"}}), ErrorCode::kOutput,
               "it holds what vggt-cd lists there as \"results\", expected \"scene\"");
  EXPECT_EQ(file_bytes(directory / "out/a.txt"), "one");
}

TEST(OutputDirectory, ACacheReplacesWhatItListedThoughDamaged) {
  const TemporaryDirectory directory;
  const OutputContents cache{kCacheKind, {"a.json"}, true, true};
  const auto write = [&] {
    OutputDirectory out(directory / "cache", cache);
    write_text_file(out / "a.json", "whole");
    out.commit();
  };
  write();
  write_bytes(directory / "cache/a.json", "wh");
  write();
  EXPECT_EQ(file_bytes(directory / "cache/a.json"), "whole");
  write_bytes(directory / "cache/.vggt-cd-results", "");
  EXPECT_ERROR(OutputDirectory(directory / "cache", cache), ErrorCode::kOutput, "cache/a.json: ");
}

TEST(OutputDirectory, TakesAnEmptyDirectoryAndStaysInIt) {
  const TemporaryDirectory directory;
  fs::create_directory(directory / "real");
  write_bytes(directory / "real/.DS_Store", "of a file manager");
  fs::create_directory(directory / "real/lost+found");
  fs::create_directory_symlink(directory / "real", directory / "link");
  const int handle = open((directory / "real").c_str(), O_RDONLY | O_DIRECTORY);
  write_results(directory / "link", "one");
  EXPECT_EQ(faccessat(handle, "a.txt", R_OK, 0), 0);  // as a mount point: not another directory
  close(handle);
  EXPECT_TRUE(fs::is_symlink(directory / "link"));
  EXPECT_EQ(file_bytes(directory / "real/a.txt"), "one");
  EXPECT_EQ(file_bytes(directory / "real/.DS_Store"), "of a file manager");
}

TEST(OutputDirectory, MakesWhatADanglingLinkLeadsTo) {
  const TemporaryDirectory directory;
  fs::create_symlink("new/place", directory / "link");
  write_results(directory / "link", "one");
  EXPECT_TRUE(fs::is_symlink(directory / "link"));
  EXPECT_EQ(file_bytes(directory / "new/place/a.txt"), "one");
  fs::create_symlink("circle", directory / "circle");
  EXPECT_ERROR(OutputDirectory(directory / "circle", contents()), ErrorCode::kOutput,
               "circle: cannot be written: ");
}

TEST(OutputDirectory, RefusesWhatIsNotOurs) {
  const TemporaryDirectory directory;
  fs::create_directory(directory / "photos");
  write_bytes(directory / "photos/a.jpg", "precious");
  write_bytes(directory / "file", "precious");
  const auto refuse = [&](const fs::path& target, std::string_view words) {
    EXPECT_ERROR(OutputDirectory(target, contents()), ErrorCode::kOutput, words);
    EXPECT_ERROR(OutputDirectory::claim(target, contents()), ErrorCode::kOutput, words);
  };
  refuse(directory / "photos",
         "photos: cannot be written: is a directory that holds other files, such as a.jpg");
  refuse(directory / "file", "is a file");
  refuse(directory / "file/out", "cannot be written");
  refuse("", "no directory given");
  refuse("/", "a directory of their own");
  refuse(".", "a directory of their own");
  EXPECT_EQ(file_bytes(directory / "photos/a.jpg"), "precious");
  EXPECT_EQ(directory.num_files(), 2u);
}

TEST(OutputDirectory, AClaimedDirectoryTakesResultsAndKeepsWhatLivesInIt) {
  const TemporaryDirectory directory;
  OutputDirectory::claim(directory / "new/out", contents());
  fs::create_directory(directory / "new/out/.stages");
  write_bytes(directory / "new/out/.stages/kept", "expensive");
  write_results(directory / "new/out", "one");
  write_results(directory / "new/out", "two");
  EXPECT_EQ(file_bytes(directory / "new/out/.stages/kept"), "expensive");
  EXPECT_EQ(file_bytes(directory / "new/out/a.txt"), "two");
}

TEST(OutputDirectory, OneAtATimeWritesIntoADirectoryThatIsThere) {
  const TemporaryDirectory directory;
  write_results(directory / "out", "one");
  const OutputDirectory first(directory / "out", contents());
  EXPECT_ERROR(OutputDirectory(directory / "out", contents()), ErrorCode::kOutput,
               "out: cannot be written: another vggt-cd is working there; wait for it");
  EXPECT_ERROR(OutputDirectory::claim(directory / "out", contents()), ErrorCode::kOutput,
               "another vggt-cd is working there");
}

// As in two containers that share a volume: both processes have one number.
TEST(OutputDirectory, TwoMayMakeOneDirectory) {
  const TemporaryDirectory directory;
  OutputDirectory first(directory / "out", contents());
  write_text_file(first / "a.txt", "first");
  write_text_file(first / "b.txt", "first");
  {
    OutputDirectory second(directory / "out", contents());
    EXPECT_NE(first.path(), second.path());
    write_text_file(second / "a.txt", "second");
    second.commit();
  }
  EXPECT_EQ(file_bytes(directory / "out/a.txt"), "second");
  first.commit();
  EXPECT_EQ(file_bytes(directory / "out/a.txt"), "first");
  EXPECT_EQ(file_bytes(directory / "out/b.txt"), "first");
  EXPECT_EQ(hidden(directory / "out"), 1u);
  EXPECT_EQ(directory.num_files(), 1u);
}

TEST(OutputDirectory, ResultsThatCannotBePutInPlaceAreNotLost) {
  const TemporaryDirectory directory;
  fs::path where;
  const auto write = [&](const std::function<void()>& meanwhile, std::string_view words) {
    OutputDirectory out(directory / "out", contents());
    write_text_file(out / "a.txt", "computed");
    meanwhile();
    EXPECT_ERROR(out.commit(), ErrorCode::kOutput, words);
    EXPECT_ERROR(out.commit(), ErrorCode::kInternal, "committed twice");
    where = out.path();
  };
  write(
      [&] {
        fs::create_directory(directory / "out");
        write_bytes(directory / "out/photo.jpg", "precious");
      },
      "such as photo.jpg; name another one, or empty it; the new results are complete in ");
  EXPECT_EQ(file_bytes(directory / "out/photo.jpg"), "precious");
  EXPECT_EQ(file_bytes(where / "a.txt"), "computed");
  fs::remove_all(directory / "out");
  write_results(directory / "out", "one");  // the next run leaves them alone
  EXPECT_EQ(file_bytes(where / "a.txt"), "computed");
  write([&] { write_bytes(directory / "out/a.txt", "edited"); },
        "out/a.txt: stands where results go, and vggt-cd did not write it; the new results are");
  EXPECT_EQ(file_bytes(directory / "out/a.txt"), "edited");
  EXPECT_EQ(file_bytes(where / "a.txt"), "computed");
}

// A process that is killed at that moment: no destructor runs in it.
void killed(const std::function<void()>& work) {
  const pid_t child = fork();
  if (child == 0) {
    work();
    raise(SIGKILL);
  }
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status));
}

void leave_behind(const fs::path& target) {
  killed([&] {
    static OutputDirectory out(target, contents());
    write_text_file(out / "a.txt", "half");
    write_bytes(out / "b.txt.partial-abcdef", "half of a file");
    write_text_file(out.subdirectory("overlays/before") / "b.txt", "half");
  });
}

TEST(OutputDirectory, RemovesWhatAKilledProcessLeft) {
  const TemporaryDirectory directory;
  leave_behind(directory / "out");
  ASSERT_EQ(directory.num_files(), 1u);
  write_results(directory / "out", "one");
  EXPECT_EQ(directory.num_files(), 1u);
  leave_behind(directory / "out");
  ASSERT_EQ(hidden(directory / "out"), 2u);
  EXPECT_EQ(file_bytes(directory / "out/a.txt"), "one");
  write_results(directory / "out", "two");
  EXPECT_EQ(hidden(directory / "out"), 1u);
  EXPECT_EQ(file_bytes(directory / "out/a.txt"), "two");
}

TEST(OutputDirectory, ANameIsNotOwnership) {
  const TemporaryDirectory directory;
  write_results(directory / "out.partial-old", "finished");
  fs::create_directory(directory / "out.partial-mine");
  write_bytes(directory / "out.partial-mine/a.jpg", "precious");
  leave_behind(directory / "out");  // somebody keeps it under another name
  for (const std::string& name : entries(directory.path())) {
    if (name == "out.partial-old" || name == "out.partial-mine") continue;
    fs::rename(directory / name, directory / "out.partial-copy");
  }
  write_results(directory / "out", "one");
  EXPECT_EQ(entries(directory.path()),
            (Names{"out", "out.partial-copy", "out.partial-mine", "out.partial-old"}));
  EXPECT_EQ(file_bytes(directory / "out.partial-old/a.txt"), "finished");
  EXPECT_EQ(file_bytes(directory / "out.partial-mine/a.jpg"), "precious");
  EXPECT_EQ(file_bytes(directory / "out.partial-copy/a.txt"), "half");
}

TEST(OutputDirectory, LeavesAloneWhatALivingProcessWritesAndWhatSomebodyPutThere) {
  const TemporaryDirectory directory;
  leave_behind(directory / "out");
  const fs::path stale = directory / entries(directory.path()).at(0);
  write_bytes(stale / "my notes.txt", "precious");
  const OutputDirectory living(directory / "out", contents());
  { const OutputDirectory other(directory / "out", contents()); }
  EXPECT_TRUE(fs::exists(living.path()));
  EXPECT_EQ(file_bytes(stale / "my notes.txt"), "precious");
}

// Runs write_results in a process that is killed when it enters its n-th system call; whether it
// was.
bool killed_at_call(int n, const fs::path& target, std::string_view text) {
  const pid_t child = fork();
  if (child == 0) {
    ptrace(PTRACE_TRACEME, 0, nullptr, nullptr);
    raise(SIGSTOP);
    write_results(target, text);
    _exit(0);
  }
  int status = 0;
  waitpid(child, &status, 0);
  for (int stops = 0; WIFSTOPPED(status); ++stops) {
    if (stops == 2 * n - 1) {  // it stops when it enters a call and when it leaves it
      kill(child, SIGKILL);
    } else {
      ptrace(PTRACE_SYSCALL, child, nullptr, nullptr);
    }
    waitpid(child, &status, 0);
  }
  return WIFSIGNALED(status);
}

bool can_trace() {
  const pid_t child = fork();
  if (child == 0) _exit(ptrace(PTRACE_TRACEME, 0, nullptr, nullptr) == 0 ? 0 : 1);
  int status = 0;
  waitpid(child, &status, 0);
  return status == 0;
}

TEST(OutputDirectory, AKillAtAnySystemCallLosesNothingAndTheNextRunPutsAllRight) {
  if (!can_trace()) GTEST_SKIP() << "no process may be traced here";
  int calls = 0;
  for (bool was_killed = true; was_killed;) {
    const TemporaryDirectory directory;
    const fs::path out = directory / "out";
    write_results(out, "one");
    write_bytes(out / "notes.txt", "of the user");
    write_bytes(out / "overlays/before/mine.txt", "of the user");
    was_killed = killed_at_call(++calls, out, "two");
    ASSERT_EQ(file_bytes(out / "notes.txt"), "of the user") << calls;
    ASSERT_EQ(file_bytes(out / "overlays/before/mine.txt"), "of the user") << calls;
    // The first name is put in place last: where it is, all is of one run.
    if (fs::exists(out / "a.txt")) {
      ASSERT_EQ(file_bytes(out / "a.txt"), file_bytes(out / "overlays/before/b.txt")) << calls;
    }
    write_results(out, "three");
    ASSERT_EQ(file_bytes(out / "a.txt"), "three") << calls;
    ASSERT_EQ(file_bytes(out / "overlays/before/b.txt"), "three") << calls;
    ASSERT_EQ(entries(out), (Names{"a.txt", "notes.txt", "overlays"})) << calls;
    ASSERT_EQ(entries(out / "overlays/before"), (Names{"b.txt", "mine.txt"})) << calls;
    ASSERT_EQ(hidden(out), 1u) << calls;
    ASSERT_EQ(directory.num_files(), 1u) << calls;
  }
  EXPECT_GT(calls, 50);
}

TEST(OutputDirectory, AKillAtAnySystemCallLeavesANewDirectoryCompleteOrNotThere) {
  if (!can_trace()) GTEST_SKIP() << "no process may be traced here";
  int calls = 0;
  for (bool was_killed = true; was_killed;) {
    const TemporaryDirectory directory;
    const fs::path out = directory / "out";
    was_killed = killed_at_call(++calls, out, "one");
    if (fs::exists(out)) {
      ASSERT_EQ(file_bytes(out / "a.txt"), "one") << calls;
      ASSERT_EQ(file_bytes(out / "overlays/before/b.txt"), "one") << calls;
    }
    write_results(out, "two");
    ASSERT_EQ(file_bytes(out / "a.txt"), "two") << calls;
    ASSERT_EQ(hidden(out), 1u) << calls;
    // A directory that does not say yet whose it is stays: an empty one, for the length of one
    // call.
    for (const std::string& name : entries(directory.path())) {
      ASSERT_TRUE(name == "out" || fs::is_empty(directory / name)) << calls << " " << name;
    }
  }
  EXPECT_GT(calls, 50);
}

// What a process that is killed within commit() leaves: the list knows old and new files.
TEST(OutputDirectory, AfterAKillWhileFilesWereMovedTheNextRunPutsAllRight) {
  const TemporaryDirectory directory;
  write_results(directory / "clean", "two");
  write_results(directory / "out", "one");
  write_bytes(directory / "out/notes.txt", "of the user");
  ResultList both = ResultList::read(directory / "out/.vggt-cd-results");
  both.add(ResultList::read(directory / "clean/.vggt-cd-results"));
  write_bytes(directory / "out/.vggt-cd-results", both.text());
  fs::remove(directory / "out/a.txt");  // put in place last
  write_bytes(directory / "out/overlays/before/b.txt", "two");
  write_results(directory / "out", "three");
  EXPECT_EQ(file_bytes(directory / "out/a.txt"), "three");
  EXPECT_EQ(file_bytes(directory / "out/overlays/before/b.txt"), "three");
  EXPECT_EQ(file_bytes(directory / "out/notes.txt"), "of the user");
}

TEST(OutputDirectory, AKillBetweenTheRenameAndTheEndLeavesGoodResults) {
  const TemporaryDirectory directory;
  write_results(directory / "out", "one");
  write_bytes(directory / "out/.vggt-cd-partial",
              "vggt-cd is writing here; what it left may be removed.\nout.partial-abcdef\na.txt\n");
  write_results(directory / "out", "two");
  EXPECT_EQ(file_bytes(directory / "out/a.txt"), "two");
  EXPECT_EQ(hidden(directory / "out"), 1u);
}

TEST(OutputDirectory, AnUnwritablePlaceIsAnOutputError) {
  // Nobody, not even root, makes directories in /proc.
  EXPECT_ERROR(OutputDirectory("/proc/out", contents()), ErrorCode::kOutput,
               "/proc/out: cannot be written");
}

TEST(OutputDirectory, RefusesALongNameOnlyIfTheFileSystemDoes) {
  const TemporaryDirectory directory;
  const std::string longest(255, 'n');
  write_results(directory / longest, "one");
  EXPECT_EQ(file_bytes(directory / longest / "a.txt"), "one");
  EXPECT_ERROR(OutputDirectory(directory / (longest + "n"), contents()), ErrorCode::kOutput,
               "cannot be written: ");
}

}  // namespace
}  // namespace vggtcd
