// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/file_system.h"

#include <gmock/gmock.h>
#include <unistd.h>

#include "tests/support/test_files.h"

namespace vggtcd {
namespace {

namespace fs = std::filesystem;

TEST(FileSystem, ALinkThatLeadsToItselfIsNotThere) {
  const TemporaryDirectory directory;
  fs::create_symlink("loop", directory / "loop");
  EXPECT_FALSE(exists_at(directory / "loop"));
  EXPECT_FALSE(is_file(directory / "loop" / "a"));
  EXPECT_FALSE(is_folder(directory / "loop"));
  EXPECT_TRUE(is_link(directory / "loop"));
}

TEST(FileSystem, AFolderThatMayNotBeEnteredHoldsNothing) {
  if (geteuid() == 0) GTEST_SKIP() << "root may enter every folder";
  const TemporaryDirectory directory;
  fs::create_directory(directory / "closed");
  write_bytes(directory / "closed" / "a", "a");
  fs::permissions(directory / "closed", fs::perms::none);
  EXPECT_FALSE(exists_at(directory / "closed" / "a"));
  EXPECT_THAT(what_stands_at(directory / "closed" / "a"),
              ::testing::HasSubstr("Permission denied"));
  EXPECT_INPUT_ERROR(list_folder(directory / "closed"),
                     "closed: cannot be listed: Permission denied");
  EXPECT_ERROR(make_folder(directory / "closed" / "b"), ErrorCode::kOutput, "Permission denied");
  fs::permissions(directory / "closed", fs::perms::owner_all);
}

TEST(FileSystem, ListsInOrderAndDoesNotFollowLinks) {
  const TemporaryDirectory directory;
  make_folder(directory / "b" / "c");
  write_bytes(directory / "b" / "c" / "d", "");
  write_bytes(directory / "a", "");
  fs::create_directory_symlink("..", directory / "b" / "up");
  EXPECT_THAT(list_folder(directory.path()),
              ::testing::ElementsAre(directory / "a", directory / "b"));
  EXPECT_THAT(list_tree(directory.path()),
              ::testing::ElementsAre(directory / "a", directory / "b", directory / "b" / "c",
                                     directory / "b" / "c" / "d", directory / "b" / "up"));
  EXPECT_INPUT_ERROR(list_folder(directory / "none"), "none: cannot be listed");
}

TEST(FileSystem, ChangesNameThePathThatFails) {
  const TemporaryDirectory directory;
  write_bytes(directory / "file", "a");
  EXPECT_ERROR(make_folder(directory / "file" / "b"), ErrorCode::kOutput, "b: cannot be created");
  EXPECT_ERROR(move_to(directory / "none", directory / "to"), ErrorCode::kOutput,
               "to: cannot be written");
  remove_tree(directory / "none");  // nothing to do
  move_to(directory / "file", directory / "to");
  copy_unless_there(directory / "to", directory / "copy");
  remove_tree(directory / "to");
  EXPECT_EQ(file_bytes(directory / "copy"), "a");
  EXPECT_EQ(directory.num_files(), 1u);
}

}  // namespace
}  // namespace vggtcd
