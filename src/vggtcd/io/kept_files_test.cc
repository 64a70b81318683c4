// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/kept_files.h"

#include <gtest/gtest.h>

#include "tests/support/test_files.h"

namespace vggtcd {
namespace {

namespace fs = std::filesystem;

TEST(KeptFiles, AFileIsKeptOnceItIsListedAndWhileItIsWhole) {
  const TemporaryDirectory folder;
  EXPECT_FALSE(is_kept(folder.path(), "a.npz"));
  write_bytes(folder / "a.npz", "all of it");
  EXPECT_FALSE(is_kept(folder.path(), "a.npz"));  // a killed run may have left half of it
  keep(folder.path(), "a.npz");
  EXPECT_TRUE(is_kept(folder.path(), "a.npz"));
  EXPECT_TRUE(damaged_files(folder.path()).empty());
  write_bytes(folder / "a.npz", "all");
  EXPECT_FALSE(is_kept(folder.path(), "a.npz"));
  EXPECT_EQ(damaged_files(folder.path()), std::vector<std::string>{"a.npz"});
  write_bytes(folder / "a.npz", "all of i?");
  EXPECT_FALSE(is_kept(folder.path(), "a.npz"));
  keep(folder.path(), "a.npz");  // made again
  EXPECT_TRUE(is_kept(folder.path(), "a.npz"));
  fs::remove(folder / "a.npz");
  EXPECT_FALSE(is_kept(folder.path(), "a.npz"));
}

TEST(KeptFiles, AFolderIsKeptWithAllOfItsFiles) {
  const TemporaryDirectory folder;
  fs::create_directory(folder / "model");
  write_bytes(folder / "model/cameras.bin", "cameras");
  write_bytes(folder / "model/images.bin", "images");
  write_bytes(folder / "model.txt", "another");
  keep(folder.path(), "model");
  EXPECT_TRUE(is_kept(folder.path(), "model"));
  EXPECT_FALSE(is_kept(folder.path(), "model.txt"));
  fs::remove(folder / "model/images.bin");
  EXPECT_FALSE(is_kept(folder.path(), "model"));
}

TEST(KeptFiles, NothingIsKeptWhereTheListIsDamaged) {
  const TemporaryDirectory folder;
  write_bytes(folder / "a.npz", "all of it");
  keep(folder.path(), "a.npz");
  const std::string list = file_bytes(folder / kKeptList);
  write_bytes(folder / kKeptList, list.substr(0, list.size() - 3));
  EXPECT_FALSE(is_kept(folder.path(), "a.npz"));
  EXPECT_EQ(damaged_files(folder.path()), std::vector<std::string>{kKeptList});
  keep(folder.path(), "a.npz");
  EXPECT_TRUE(is_kept(folder.path(), "a.npz"));
}

}  // namespace
}  // namespace vggtcd
