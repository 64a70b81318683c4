// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/output_directory.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>

#include "tests/support/test_files.h"
#include "vggtcd/io/npz.h"
#include "vggtcd/io/output_file.h"

namespace vggtcd {
namespace {

void write_results(const std::filesystem::path& target, std::string_view text) {
  OutputDirectory out(target);
  write_text_file(out / "a.txt", text);
  write_text_file(out.subdirectory("overlays/before") / "b.txt", text);
  EXPECT_TRUE(!std::filesystem::exists(target / "a.txt") || file_bytes(target / "a.txt") != text);
  out.commit();
}

TEST(OutputDirectory, AppearsOnCommitWithEverything) {
  const TemporaryDirectory directory;
  write_results(directory / "out", "one");
  EXPECT_EQ(file_bytes(directory / "out/a.txt"), "one");
  EXPECT_EQ(file_bytes(directory / "out/overlays/before/b.txt"), "one");
  EXPECT_EQ(directory.num_files(), 1u);
}

TEST(OutputDirectory, WithoutCommitLeavesNothing) {
  const TemporaryDirectory directory;
  {
    OutputDirectory out(directory / "new/parents/out");
    write_text_file(out / "a.txt", "x");
  }
  EXPECT_EQ(directory.num_files(), 0u);
}

TEST(OutputDirectory, ReplacesEarlierResultsAsAWhole) {
  const TemporaryDirectory directory;
  write_results(directory / "out", "one");
  write_text_file(directory / "out/old.txt", "of the first run");
  write_results(directory / "out/", "two");
  EXPECT_EQ(file_bytes(directory / "out/a.txt"), "two");
  EXPECT_FALSE(std::filesystem::exists(directory / "out/old.txt"));
  EXPECT_EQ(directory.num_files(), 1u);
  {
    OutputDirectory failed(directory / "out");
    write_text_file(failed / "a.txt", "three");
  }
  EXPECT_EQ(file_bytes(directory / "out/a.txt"), "two");
}

TEST(OutputDirectory, TakesAnEmptyDirectoryAndFollowsALink) {
  const TemporaryDirectory directory;
  std::filesystem::create_directory(directory / "real");
  std::filesystem::create_directory_symlink(directory / "real", directory / "link");
  write_results(directory / "link", "one");
  EXPECT_TRUE(std::filesystem::is_symlink(directory / "link"));
  EXPECT_EQ(file_bytes(directory / "real/a.txt"), "one");
}

TEST(OutputDirectory, RefusesWhatIsNotOurs) {
  const TemporaryDirectory directory;
  std::filesystem::create_directory(directory / "photos");
  write_bytes(directory / "photos/a.jpg", "precious");
  write_bytes(directory / "file", "precious");
  EXPECT_ERROR(OutputDirectory(directory / "photos"), ErrorCode::kOutput,
               "photos: cannot be written: is a directory that holds other files");
  EXPECT_ERROR(OutputDirectory(directory / "file"), ErrorCode::kOutput, "is a file");
  EXPECT_ERROR(OutputDirectory(directory / "file/out"), ErrorCode::kOutput, "cannot be written");
  EXPECT_ERROR(OutputDirectory(""), ErrorCode::kOutput, "no directory given");
  EXPECT_ERROR(OutputDirectory("/"), ErrorCode::kOutput, "a directory of their own");
  EXPECT_ERROR(OutputDirectory("."), ErrorCode::kOutput, "a directory of their own");
  EXPECT_EQ(file_bytes(directory / "photos/a.jpg"), "precious");
  EXPECT_EQ(directory.num_files(), 2u);
}

TEST(OutputDirectory, RefusesFilesThatAppearedMeanwhile) {
  const TemporaryDirectory directory;
  {
    OutputDirectory out(directory / "out");
    std::filesystem::create_directory(directory / "out");
    write_bytes(directory / "out/a.jpg", "precious");
    EXPECT_ERROR(out.commit(), ErrorCode::kOutput, "holds other files");
  }
  EXPECT_EQ(file_bytes(directory / "out/a.jpg"), "precious");
  EXPECT_EQ(directory.num_files(), 1u);
}

// The directory that a process killed at that moment leaves: no destructor runs in it.
void leave_behind(const std::filesystem::path& target) {
  const pid_t child = fork();
  if (child == 0) {
    static OutputDirectory out(target, {"kept"});
    write_text_file(out / "a.txt", "half");
    if (std::filesystem::exists(target / "kept")) {  // as in the middle of commit()
      std::filesystem::rename(target / "kept", out / "kept");
    }
    raise(SIGKILL);
  }
  int status = 0;
  waitpid(child, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status));
}

TEST(OutputDirectory, RemovesWhatAKilledProcessLeft) {
  const TemporaryDirectory directory;
  leave_behind(directory / "out");
  ASSERT_EQ(directory.num_files(), 1u);
  write_results(directory / "out", "one");
  EXPECT_EQ(directory.num_files(), 1u);
  EXPECT_EQ(file_bytes(directory / "out/a.txt"), "one");
}

TEST(OutputDirectory, GivesBackWhatAKilledProcessHadTaken) {
  const TemporaryDirectory directory;
  write_results(directory / "out", "one");
  write_text_file(directory / "out/kept", "expensive");
  leave_behind(directory / "out");
  ASSERT_FALSE(std::filesystem::exists(directory / "out/kept"));
  OutputDirectory out(directory / "out", {"kept"});
  EXPECT_EQ(file_bytes(directory / "out/kept"), "expensive");
  out.commit();
  EXPECT_EQ(file_bytes(directory / "out/kept"), "expensive");
  EXPECT_EQ(directory.num_files(), 1u);
}

TEST(OutputDirectory, LeavesAloneWhatALivingProcessWritesOrOthersOwn) {
  const TemporaryDirectory directory;
  std::filesystem::create_directory(directory / "out.partial-mine");
  write_bytes(directory / "out.partial-mine/a.jpg", "precious");
  OutputDirectory living(directory / "out");
  // As another process would look at it: under a name that is not this process's own.
  std::filesystem::rename(living.path(), directory / "out.partial-0");
  { const OutputDirectory other(directory / "out"); }
  EXPECT_TRUE(std::filesystem::exists(directory / "out.partial-0"));
  EXPECT_EQ(file_bytes(directory / "out.partial-mine/a.jpg"), "precious");
}

TEST(OutputDirectory, AnUnwritablePlaceIsAnOutputError) {
  // Nobody, not even root, makes directories in /proc.
  EXPECT_ERROR(OutputDirectory("/proc/out"), ErrorCode::kOutput, "/proc/out: cannot be written");
}

// A full disk, imitated by a limit on the size of files (the signal off: write() then fails).
class FullDisk {
 public:
  FullDisk() {
    std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limit{4096, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FullDisk() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, SIG_DFL);
  }

 private:
  rlimit before_{};
};

TEST(OutputFile, AFullDiskIsAnOutputErrorAndLeavesTheOldFile) {
  const TemporaryDirectory directory;
  write_text_file(directory / "a.txt", "old");
  {
    const FullDisk full;
    const std::string text(100000, 'x');
    EXPECT_ERROR(write_text_file(directory / "a.txt", text), ErrorCode::kOutput,
                 "a.txt: cannot be written: File too large");
    const std::vector<uint8_t> values(100000);
    const auto write_npz = [&] {
      NpzWriter npz(directory / "b.npz");
      npz.add<uint8_t>("x", {100000}, values);
      npz.finish();
    };
    EXPECT_ERROR(write_npz(), ErrorCode::kOutput, "b.npz: cannot be written");
  }
  EXPECT_EQ(file_bytes(directory / "a.txt"), "old");
  EXPECT_EQ(directory.num_files(), 1u);
}

}  // namespace
}  // namespace vggtcd
