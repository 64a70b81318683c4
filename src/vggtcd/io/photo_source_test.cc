// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/photo_source.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#ifdef VGGTCD_WITH_VIDEO
#include <opencv2/videoio.hpp>
#endif

#include "tests/support/test_files.h"
#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::filesystem::path fresh_folder(const char* name) {
  // Of this process alone: other checkouts may run the same test now.
  static const TemporaryDirectory directory;
  const auto folder = directory / name;
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

TEST(FindPhotos, CountsWhatIsNoPhotoInANotice) {
  const auto folder = fresh_folder("photo_source_others");
  write_photo(folder / "a.png", 1);
  std::ofstream(folder / "notes.txt") << "no photo";
  std::ofstream(folder / "video.mp4") << "no photo either";
  RecordingProgress progress;
  EXPECT_THAT(names_of(find_photos(folder, {}, progress)), ElementsAre("a.png"));
  EXPECT_THAT(progress.notices, ElementsAre(HasSubstr("2 files are not photos")));
  std::filesystem::remove(folder / "video.mp4");
  RecordingProgress of_one;
  find_photos(folder, {}, of_one);
  EXPECT_THAT(of_one.notices, ElementsAre(HasSubstr("notes.txt is not a photo")));
}

TEST(FindPhotos, AFileStandsForItselfWhateverItsEnding) {
  const auto folder = fresh_folder("photo_source_file");
  std::ofstream(folder / "a.unusual") << "x";
  EXPECT_THAT(names_of(find_photos(folder / "a.unusual", {}, silent_progress())),
              ElementsAre("a.unusual"));
}

TEST(FindPhotos, LeavesOutDuplicatesWithANotice) {
  const auto folder = fresh_folder("photo_source_duplicates");
  write_photo(folder / "a.png", 1);
  write_photo(folder / "b.png", 1);
  write_photo(folder / "c.png", 2);
  RecordingProgress progress;
  EXPECT_THAT(names_of(find_photos(folder, {}, progress)), ElementsAre("a.png", "c.png"));
  EXPECT_THAT(progress.notices, ElementsAre(HasSubstr("b.png is the same photo as a.png")));
}

TEST(FindPhotos, RefusesWhatHoldsNoPhotosNamingIt) {
  const auto folder = fresh_folder("photo_source_empty");
  EXPECT_THAT(refusal(folder), HasSubstr("found none"));
  EXPECT_THAT(refusal(folder / "nothing"), HasSubstr("no such file"));
  EXPECT_THAT(refusal(folder / "*.jpg"), HasSubstr("found none"));
  std::ofstream(folder / "broken.mp4") << "not a video";
  EXPECT_THAT(refusal(folder / "broken.mp4"), HasSubstr("broken.mp4"));
  EXPECT_THAT(refusal(folder), HasSubstr("found only broken.mp4; name the video itself: " +
                                         (folder / "broken.mp4").string()));
  std::filesystem::remove(folder / "broken.mp4");
  std::ofstream(folder / "a.txt") << "no photo";
  std::ofstream(folder / "b.txt") << "no photo";
  EXPECT_THAT(refusal(folder), HasSubstr("found 2 other files, such as "));
  std::filesystem::create_directory(folder / "walk");
  EXPECT_THAT(refusal(folder), HasSubstr("name the folder itself, " + (folder / "walk").string()));
}

#ifdef VGGTCD_WITH_VIDEO
// 24 frames, one after another brighter; every third is sharp (a chequerboard), the others are not.
std::filesystem::path write_video(const char* name) {
  const auto path = fresh_folder(name) / "walk.avi";
  cv::VideoWriter video(path.string(), cv::CAP_FFMPEG, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'),
                        10, {160, 96});
  for (int frame = 0; frame < 24; ++frame) {
    cv::Mat picture(96, 160, CV_8UC3, cv::Scalar::all(10 * frame));
    for (int v = 0; v < 96; ++v) {
      for (int u = 0; u < 160; ++u) {
        const bool white = frame % 3 == 1 && (u / 8 + v / 8) % 2 == 0;
        if (white && u < 80) picture.at<cv::Vec3b>(v, u) = {255, 255, 255};
      }
    }
    video.write(picture);
  }
  return path;
}

TEST(FindPhotos, OfAVideoTakesTheSharpestFrameOfEachStretch) {
  const auto path = write_video("photo_source_video");
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "OpenCV cannot write videos here";
  const auto photos = find_photos(path, {.max_frames = 8, .read = {}}, silent_progress());
  EXPECT_THAT(names_of(photos), ElementsAre("walk_000001.avi", "walk_000004.avi", "walk_000007.avi",
                                            "walk_000010.avi", "walk_000013.avi", "walk_000016.avi",
                                            "walk_000019.avi", "walk_000022.avi"));
  for (size_t k = 0; k < photos.size(); ++k) {
    const Image frame = load_photo(photos[k]);
    ASSERT_EQ(frame.width, 160);
    // The frame itself, not a neighbour: its grey level, within what JPEG does to it.
    EXPECT_NEAR(frame.pixel(120, 40)[0], 10 * (3 * static_cast<int>(k) + 1), 4);
  }
}

TEST(FindPhotos, OfAShortVideoTakesAllFrames) {
  const auto path = write_video("photo_source_short_video");
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "OpenCV cannot write videos here";
  EXPECT_EQ(find_photos(path, {}, silent_progress()).size(), 24u);
}
#endif

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
