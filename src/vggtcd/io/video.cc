// SPDX-License-Identifier: Apache-2.0
// Frames of a video: evenly spread, and sharp among their neighbours.
#include "vggtcd/io/video.h"

#include <algorithm>
#include <cstdlib>

#include "vggtcd/core/error.h"
#ifdef VGGTCD_WITH_VIDEO
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "vggtcd/core/interrupt.h"
#include "vggtcd/io/foreign_lines.h"
#endif

namespace vggtcd {

#ifdef VGGTCD_WITH_VIDEO
namespace {

Image image_of(const cv::Mat& bgr) {
  Image image(bgr.cols, bgr.rows);
  cv::Mat rgb(bgr.rows, bgr.cols, CV_8UC3, image.rgb.data());
  cv::cvtColor(bgr, rgb, cv::COLOR_BGR2RGB);
  return image;
}

// A video whose reader prints nothing.
class Video {
 public:
  explicit Video(const std::string& path) {
    setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", 0);  // we say ourselves what is wrong
    const ForeignLines foreign;
    // One backend, not whichever OpenCV finds first: they count and seek frames differently.
    video_.open(path, cv::CAP_FFMPEG);
    if (video_.isOpened()) expected_frames_ = video_.get(cv::CAP_PROP_FRAME_COUNT);
  }
  bool read(cv::Mat& frame) {
    const ForeignLines foreign;
    return video_.isOpened() && video_.read(frame) && !frame.empty();
  }
  double expected_frames() const { return expected_frames_; }  // a guess; 0: none

 private:
  cv::VideoCapture video_;
  double expected_frames_ = 0;
};

// Calls use(number, frame) for every frame, and advance(share); returns how many frames there are.
template <typename Use, typename Advance>
int for_each_frame(const std::string& path, const Use& use, const Advance& advance) {
  Video video(path);
  int count = 0;
  for (cv::Mat frame; video.read(frame); ++count) {
    throw_if_interrupted();
    use(count, frame);
    if (video.expected_frames() > 0) advance(std::min(1.0, (count + 1) / video.expected_frames()));
  }
  return count;
}

}  // namespace

std::vector<PhotoRef> read_video(const std::string& path, int frames, ProgressSink& progress) {
  ProgressStage stage(progress, "read video");
  std::vector<double> sharp;
  const int count = for_each_frame(
      path,
      [&](int number, const cv::Mat& frame) {
        if (number == 0) require_photo_size(image_of(frame), path);
        // A quarter of the size is enough to rank by, and sixteen times faster.
        cv::Mat small;
        cv::resize(frame, small, {}, 0.25, 0.25, cv::INTER_AREA);
        sharp.push_back(sharpness(image_of(small)));
      },
      [&](double share) { stage.advance(0.5 * share); });
  if (count == 0) {
    throw_error(ErrorCode::kInput,
                "{}: expected a video, found no frame that can be decoded; convert it, or extract "
                "photos from it (ffmpeg -i VIDEO photos/%04d.jpg)",
                path);
  }
  if (count == 1) {
    throw_error(
        ErrorCode::kInput,
        "{}: expected a video, found a single picture, perhaps its cover; extract photos from "
        "the video itself (ffmpeg -i VIDEO -map 0:V photos/%04d.jpg)",
        path);
  }
  const int wanted = std::min(frames, count);
  std::vector<int> chosen;
  for (int i = 0; i < wanted; ++i) {
    const auto begin = sharp.begin() + static_cast<std::ptrdiff_t>(int64_t{i} * count / wanted);
    const auto end = sharp.begin() + static_cast<std::ptrdiff_t>(int64_t{i + 1} * count / wanted);
    chosen.push_back(static_cast<int>(std::max_element(begin, end) - sharp.begin()));
  }
  std::vector<PhotoRef> photos;
  const std::filesystem::path file(path);
  for_each_frame(
      path,
      [&](int number, const cv::Mat& frame) {
        if (!std::binary_search(chosen.begin(), chosen.end(), number)) return;
        photos.push_back(
            {path,
             fmt::format("{}_{:06d}{}", file.stem().string(), number, file.extension().string()),
             std::make_shared<const Image>(image_of(frame))});
      },
      [&](double share) { stage.advance(0.5 + 0.5 * share); });
  return photos;
}
#else
std::vector<PhotoRef> read_video(const std::string& path, int, ProgressSink&) {
  throw_error(ErrorCode::kUnavailable,
              "{}: this build reads no videos (libopencv-videoio-dev was missing); extract photos "
              "(ffmpeg -i VIDEO photos/%04d.jpg) and give their folder",
              path);
}
#endif

}  // namespace vggtcd
