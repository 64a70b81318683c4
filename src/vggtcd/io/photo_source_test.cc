// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/photo_source.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::filesystem::path fresh_folder(const char* name) {
  const auto folder = std::filesystem::path(::testing::TempDir()) / name;
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  return folder;
}

void write_photo(const std::filesystem::path& path, int shade) {
  cv::imwrite(path.string(), cv::Mat(4, 6, CV_8UC3, cv::Scalar::all(shade)));
}

std::vector<std::string> names_of(const std::vector<PhotoRef>& photos) {
  std::vector<std::string> names;
  for (const PhotoRef& photo : photos) names.push_back(photo.name);
  return names;
}

std::string refusal(const std::string& source) {
  try {
    find_photos(source, {}, silent_progress());
  } catch (const Error& error) {
    return error.what();
  }
  return "not refused";
}

TEST(NaturalLess, OrdersNumbersByValueAndIsAStrictOrder) {
  std::vector<std::string> names = {"b1", "a10", "a9", "a09", "a", "a1b2", "a1b10", "", "a010"};
  std::sort(names.begin(), names.end(), natural_less);
  EXPECT_THAT(names, ElementsAre("", "a", "a1b2", "a1b10", "a09", "a9", "a010", "a10", "b1"));
  for (const auto& a : names) {
    for (const auto& b : names) {
      EXPECT_EQ(static_cast<int>(natural_less(a, b)) + static_cast<int>(natural_less(b, a)),
                a == b ? 0 : 1)
          << a << " " << b;
    }
  }
}

TEST(FindPhotos, ListsAFolderInNaturalOrderWithoutOtherFiles) {
  const auto folder = fresh_folder("photo_source_folder");
  for (const int i : {10, 9, 2}) write_photo(folder / ("p" + std::to_string(i) + ".png"), i);
  write_photo(folder / "P1.png", 1);
  std::filesystem::rename(folder / "P1.png", folder / "P1.PNG");
  std::ofstream(folder / "notes.txt") << "no photo";
  EXPECT_THAT(names_of(find_photos(folder, {}, silent_progress())),
              ElementsAre("P1.PNG", "p2.png", "p9.png", "p10.png"));
  EXPECT_THAT(names_of(find_photos(folder / "p?.png", {}, silent_progress())),
              ElementsAre("p2.png", "p9.png"));
  EXPECT_THAT(names_of(find_photos(folder, {.max_frames = 2, .read = {}}, silent_progress())),
              ElementsAre("P1.PNG", "p10.png"));
}

TEST(FindPhotos, LeavesOutDuplicatesWithANotice) {
  class Notices : public ProgressSink {
   public:
    void stage_started(std::string_view) override {}
    void stage_advanced(std::string_view, double) override {}
    void stage_finished(std::string_view, double) override {}
    void notice(std::string_view message) override { text += message; }
    std::string text;
  } notices;
  const auto folder = fresh_folder("photo_source_duplicates");
  write_photo(folder / "a.png", 1);
  write_photo(folder / "b.png", 1);
  write_photo(folder / "c.png", 2);
  EXPECT_THAT(names_of(find_photos(folder, {}, notices)), ElementsAre("a.png", "c.png"));
  EXPECT_THAT(notices.text, HasSubstr("b.png is the same photo as a.png"));
}

TEST(FindPhotos, RefusesWhatHoldsNoPhotosNamingIt) {
  const auto folder = fresh_folder("photo_source_empty");
  EXPECT_THAT(refusal(folder), HasSubstr("found none"));
  EXPECT_THAT(refusal(folder / "nothing"), HasSubstr("no such file"));
  EXPECT_THAT(refusal(folder / "*.jpg"), HasSubstr("found none"));
  std::ofstream(folder / "broken.mp4") << "not a video";
  EXPECT_THAT(refusal(folder / "broken.mp4"), HasSubstr("broken.mp4"));
  std::ofstream(folder / "phone.heic") << "x";
  const auto heic = find_photos(folder, {}, silent_progress());
  try {
    load_photo(heic.front());
    FAIL() << "not refused";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("heif-convert"));
  }
}

TEST(EvenlySpaced, IncludesBothEnds) {
  EXPECT_THAT(evenly_spaced(10, 4), ElementsAre(0, 3, 6, 9));
  EXPECT_THAT(evenly_spaced(3, 5), ElementsAre(0, 1, 2));
  EXPECT_THAT(evenly_spaced(5, 1), ElementsAre(0));
}

TEST(Sharpness, IsLargerForAnEdgeThanForARamp) {
  Image ramp(64, 64), edge(64, 64);
  for (int v = 0; v < 64; ++v) {
    for (int u = 0; u < 64; ++u) {
      std::fill_n(ramp.pixel(u, v), 3, static_cast<uint8_t>(u * 4));
      std::fill_n(edge.pixel(u, v), 3, static_cast<uint8_t>(u < 32 ? 0 : 252));
    }
  }
  EXPECT_GT(sharpness(edge), 10 * sharpness(ramp));
}

}  // namespace
}  // namespace vggtcd
