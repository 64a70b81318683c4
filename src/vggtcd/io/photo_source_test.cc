// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/photo_source.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#ifdef VGGTCD_WITH_VIDEO
#include <opencv2/videoio.hpp>
#endif

#include "tests/support/test_files.h"
#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"

namespace vggtcd {
namespace {

using ::testing::AllOf;
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

// Large enough to be told apart; `step` moves what it shows.
cv::Mat picture_of(int step) {
  cv::Mat picture(96, 128, CV_8UC3);
  cv::RNG(11).fill(picture, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(picture, picture, {0, 0}, 6);
  cv::normalize(picture, picture, 0, 255, cv::NORM_MINMAX);
  if (step == 0) return picture;
  cv::Mat moved;
  cv::hconcat(picture.colRange(step, 128), picture.colRange(0, step), moved);
  return moved;
}

TEST(FindPhotos, LeavesOutMasksByTheNamesThatProgramsGiveThem) {
  const auto folder = fresh_folder("photo_source_masks");
  int shade = 0;
  for (const char* name :
       {"DJI_1.JPG", "DJI_1_mask.JPG", "DJI_2.JPG", "DJI_2_MASK.png", "a.JPG", "a.mask.png",
        "b.jpg", "b.jpg.png", "c.png", "c-mask.png", "mask.png", "face_mask.jpg", "unmasked.jpg"}) {
    write_photo(folder / name, ++shade);
  }
  RecordingProgress progress;
  EXPECT_THAT(names_of(find_photos(folder, {}, progress)),
              ElementsAre("DJI_1.JPG", "DJI_2.JPG", "a.JPG", "b.jpg", "c.png", "face_mask.jpg",
                          "unmasked.jpg"));
  EXPECT_THAT(progress.notices, ElementsAre(HasSubstr("6 files are masks")));
  EXPECT_THAT(names_of(find_photos(folder / "*.JPG", {}, silent_progress())),
              ElementsAre("DJI_1.JPG", "DJI_2.JPG", "a.JPG"));
  EXPECT_THAT(names_of(find_photos(folder / "mask.png", {}, silent_progress())),
              ElementsAre("mask.png"));
}

TEST(FindPhotos, CountsAPhotoInTwoFormatsOnceAndKeepsTwoPhotosOfOneName) {
  const auto folder = fresh_folder("photo_source_formats");
  cv::imwrite((folder / "one.JPG").string(), picture_of(0), {cv::IMWRITE_JPEG_QUALITY, 60});
  cv::imwrite((folder / "one.png").string(), picture_of(0));
  cv::imwrite((folder / "two.jpg").string(), picture_of(0));
  cv::imwrite((folder / "two.png").string(), picture_of(12));  // edited, or another photo
  cv::Mat small;
  cv::resize(picture_of(24), small, {64, 48}, 0, 0, cv::INTER_AREA);
  cv::imwrite((folder / "three.jpg").string(), small);
  cv::imwrite((folder / "three.webp").string(), picture_of(24));
  cv::imwrite((folder / "bad.jpg").string(), picture_of(36));
  std::ofstream(folder / "bad.png") << "no photo";
  RecordingProgress progress;
  EXPECT_THAT(names_of(find_photos(folder, {}, progress)),
              ElementsAre("bad.jpg", "bad.png", "one.JPG", "three.webp", "two.jpg", "two.png"));
  EXPECT_THAT(progress.notices,
              ElementsAre(AllOf(HasSubstr("2 photos repeat"), HasSubstr("one.png, three.jpg"))));
}

TEST(LoadPhoto, RefusesWhatIsTooSmallToShowAnything) {
  const auto folder = fresh_folder("photo_source_small");
  write_photo(folder / "a.png", 1);
  EXPECT_INPUT_ERROR(load_photo({folder / "a.png", "a.png", nullptr}),
                     "a.png: expected pictures of at least 16 px a side, found 6 x 4");
}

TEST(PhotoRemarks, AreToldOnceEachWithThePhotosThatTheyAreTrueOf) {
  PhotoRemarks remarks;
  remarks.add("before/a.png", {{}, {"bad profile"}});
  remarks.add("before/b.png", {{}, {}});
  remarks.add("after/a.png", {{}, {"half is missing", "bad profile"}});
  RecordingProgress progress;
  remarks.report(progress);
  EXPECT_THAT(progress.notices, ElementsAre("before/a.png and 1 more like it: bad profile",
                                            "after/a.png: half is missing"));
}

TEST(PhotosAtOnce, AreAsManyAsThreadsIfTheyAreOfOrdinarySize) {
  EXPECT_EQ(photos_at_once(0), num_threads());
  EXPECT_EQ(photos_at_once(1'000'000), num_threads());
  EXPECT_EQ(photos_at_once(3'000'000'000), 1);
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

TEST(FindPhotos, OfAVideoWithoutAPictureWorthTheNameSaysSo) {
  const auto path = fresh_folder("photo_source_tiny_video") / "tiny.avi";
  for (const int side : {8, 64}) {
    {
      cv::VideoWriter video(path.string(), cv::CAP_FFMPEG,
                            cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 10, {side, side});
      for (int i = 0; i < (side == 8 ? 5 : 1); ++i) {
        video.write(cv::Mat(side, side, CV_8UC3, cv::Scalar::all(20 * i)));
      }
    }
    if (!std::filesystem::exists(path)) GTEST_SKIP() << "OpenCV cannot write videos here";
    EXPECT_THAT(refusal(path), HasSubstr(side == 8 ? "tiny.avi: expected pictures of at least 16 px"
                                                   : "tiny.avi: expected a video, found a single"));
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
