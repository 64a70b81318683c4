// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/photo_list.h"

#include <gmock/gmock.h>

#include <fstream>

#include "tests/support/test_files.h"
#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

class PhotoList : public ::testing::Test {
 protected:
  PhotoList() { fs::create_directories(folder_ / "below"); }
  void touch(const std::string& name) { std::ofstream(folder_ / name) << "x"; }
  const TemporaryDirectory temporary_;
  const fs::path folder_ = temporary_.path();
};

TEST(NaturalOrder, NumbersCompareAsNumbers) {
  const std::vector<std::string> order = {"",
                                          "1",
                                          "2",
                                          "10",
                                          "a",
                                          "a1b2",
                                          "a1b10",
                                          "a02",
                                          "a2",
                                          "a10",
                                          "a10.1",
                                          "b",
                                          "b99999999999999999999",
                                          "b100000000000000000000"};
  for (size_t i = 0; i < order.size(); ++i) {
    for (size_t j = 0; j < order.size(); ++j) {
      EXPECT_EQ(natural_less(order[i], order[j]), i < j) << order[i] << " < " << order[j];
    }
  }
}

TEST_F(PhotoList, AFolderIsItsPhotosInNaturalOrder) {
  for (const char* name : {"p10.JPG", "p9.jpg", "p1.png", "notes.txt", "video.mp4", "below/x.jpg"})
    touch(name);
  RecordingProgress progress;
  EXPECT_EQ(list_photos(std::span(&folder_, 1), progress),
            (std::vector<fs::path>{folder_ / "p1.png", folder_ / "p9.jpg", folder_ / "p10.JPG"}));
  EXPECT_THAT(progress.notices, ElementsAre(HasSubstr("2 files are not photos")));
}

TEST_F(PhotoList, FilesKeepTheOrderGiven) {
  touch("b.jpg");
  touch("a.unusual");
  const std::vector<fs::path> files = {folder_ / "b.jpg", folder_ / "a.unusual"};
  EXPECT_EQ(list_photos(files), files);
}

TEST_F(PhotoList, MissingPathsAndFoldersWithoutPhotosAreNamed) {
  touch("a.txt");
  for (const fs::path& path : {folder_, folder_ / "none.jpg"}) {
    try {
      list_photos(std::span(&path, 1));
      FAIL();
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kInput);
      EXPECT_TRUE(std::string(error.what()).starts_with(path.string() + ": ")) << error.what();
    }
  }
}

}  // namespace
}  // namespace vggtcd
