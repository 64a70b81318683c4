// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/output_file.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>
#include <memory>

#include "tests/support/test_files.h"
#include "vggtcd/io/npz.h"

namespace vggtcd {
namespace {

namespace fs = std::filesystem;

void write_npz(const fs::path& path) {
  const std::vector<uint8_t> values(100000);
  NpzWriter npz(path);
  npz.add<uint8_t>("x", {100000}, values);
  npz.finish();
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
    EXPECT_ERROR(write_npz(directory / "b.npz"), ErrorCode::kOutput, "b.npz: cannot be written");
  }
  EXPECT_EQ(file_bytes(directory / "a.txt"), "old");
  EXPECT_EQ(directory.num_files(), 1u);
}

TEST(OutputFile, ALinkStaysWhetherItsTargetIsThereOrNot) {
  const TemporaryDirectory directory;
  fs::create_directory(directory / "elsewhere");
  write_bytes(directory / "elsewhere/old.txt", "old");
  fs::create_symlink("elsewhere/old.txt", directory / "to_old");
  fs::create_symlink("elsewhere/new.txt", directory / "to_new");
  fs::create_symlink("elsewhere/new.npz", directory / "to_npz");
  write_text_file(directory / "to_old", "text");
  write_text_file(directory / "to_new", "text");
  write_npz(directory / "to_npz");
  EXPECT_EQ(file_bytes(directory / "elsewhere/old.txt"), "text");
  EXPECT_EQ(file_bytes(directory / "elsewhere/new.txt"), "text");
  EXPECT_GT(fs::file_size(directory / "elsewhere/new.npz"), 100000u);
  for (const char* link : {"to_old", "to_new", "to_npz"}) {
    EXPECT_TRUE(fs::is_symlink(directory / link)) << link;
  }
}

TEST(OutputFile, RefusesLinksInACircle) {
  const TemporaryDirectory directory;
  fs::create_symlink("b", directory / "a");
  fs::create_symlink("a", directory / "b");
  EXPECT_ERROR(OutputFile(directory / "a"), ErrorCode::kOutput, "a: cannot be written: ");
  EXPECT_ERROR(write_npz(directory / "a"), ErrorCode::kOutput, "a: cannot be written: ");
  EXPECT_TRUE(fs::is_symlink(directory / "a"));
}

TEST(OutputFile, RefusesDevicesPipesAndDirectories) {
  const TemporaryDirectory directory;
  ASSERT_EQ(mkfifo((directory / "pipe").c_str(), 0600), 0);
  EXPECT_ERROR(OutputFile(directory / "pipe"), ErrorCode::kOutput, "found a device or a pipe");
  EXPECT_ERROR(write_npz(directory / "pipe"), ErrorCode::kOutput, "found a device or a pipe");
  EXPECT_ERROR(OutputFile("/dev/null"), ErrorCode::kOutput, "found a device or a pipe");
  EXPECT_ERROR(OutputFile(directory.path()), ErrorCode::kOutput, "Is a directory");
  EXPECT_ERROR(OutputFile(""), ErrorCode::kOutput, "cannot be written");
}

// As in two containers, where both processes have the number 1.
TEST(OutputFile, TwoWritersOfOneProcessNumberDoNotMix) {
  const TemporaryDirectory directory;
  auto first = std::make_unique<OutputFile>(directory / "a.txt");
  OutputFile second(directory / "a.txt");
  first->write("first");
  second.write("second");
  second.commit();
  EXPECT_EQ(file_bytes(directory / "a.txt"), "second");
  first->commit();
  EXPECT_EQ(file_bytes(directory / "a.txt"), "first");
  EXPECT_EQ(directory.num_files(), 1u);
}

TEST(OutputFile, HasThePermissionsOfOtherNewFiles) {
  const TemporaryDirectory directory;
  write_text_file(directory / "a.txt", "x");
  write_bytes(directory / "b.txt", "x");
  EXPECT_EQ(fs::status(directory / "a.txt").permissions(),
            fs::status(directory / "b.txt").permissions());
}

}  // namespace
}  // namespace vggtcd
