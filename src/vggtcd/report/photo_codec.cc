// SPDX-License-Identifier: Apache-2.0
// The photos and score maps of an epoch as the page carries them.
#include "vggtcd/report/photo_codec.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/report/point_codec.h"

namespace vggtcd {
namespace {

int scaled(int size, double scale) {
  return std::max(1, static_cast<int>(std::lround(size * scale)));
}

void encode_image(const Image& image, const PhotoQuality& quality, EncodedPhoto& photo) {
  photo.width = scaled(image.width, quality.photo_scale);
  photo.height = scaled(image.height, quality.photo_scale);
  const cv::Mat rgb(image.height, image.width, CV_8UC3, const_cast<uint8_t*>(image.rgb.data()));
  cv::Mat bgr;
  cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
  if (bgr.cols != photo.width || bgr.rows != photo.height) {
    cv::Mat small;
    cv::resize(bgr, small, {photo.width, photo.height}, 0, 0, cv::INTER_AREA);
    bgr = small;
  }
  std::vector<uint8_t> jpeg;
  check(cv::imencode(".jpg", bgr, jpeg, {cv::IMWRITE_JPEG_QUALITY, quality.jpeg_quality}),
        "encode_image: JPEG");
  photo.jpeg.assign(jpeg.begin(), jpeg.end());
}

// Nearest pixels of a [height, width] map, each through `value`.
template <typename Value>
std::string sample_map(int width, int height, const EncodedPhoto& photo, const Value& value) {
  std::string bytes;
  bytes.reserve(static_cast<size_t>(photo.heat_width) * static_cast<size_t>(photo.heat_height));
  for (int y = 0; y < photo.heat_height; ++y) {
    const int from_y = (2 * y + 1) * height / (2 * photo.heat_height);
    for (int x = 0; x < photo.heat_width; ++x) {
      const int from_x = (2 * x + 1) * width / (2 * photo.heat_width);
      bytes.push_back(static_cast<char>(value(
          static_cast<size_t>(from_y) * static_cast<size_t>(width) + static_cast<size_t>(from_x))));
    }
  }
  return deflate_bytes(bytes);
}

void encode_heat(const ReportEpoch& epoch, size_t frame, const LevelScale& scale,
                 const PhotoQuality& quality, EncodedPhoto& photo) {
  const size_t size = static_cast<size_t>(epoch.width) * static_cast<size_t>(epoch.height);
  const auto score = std::span(epoch.score).subspan(frame * size, size);
  const bool labelled = !epoch.label.empty();
  const auto label =
      labelled ? std::span(epoch.label).subspan(frame * size, size) : std::span<const uint8_t>();
  for (size_t i = 0; i < size; ++i) {
    if (labelled ? label[i] == 255 : std::isnan(score[i])) continue;
    ++photo.pixels;
    photo.changed += labelled ? label[i] == 1 || label[i] == 2 || label[i] == 4
                              : score[i] > scale.edge(scale.threshold_level());
  }
  photo.heat_width = scaled(epoch.width, quality.heat_scale);
  photo.heat_height = scaled(epoch.height, quality.heat_scale);
  photo.heat_level =
      sample_map(epoch.width, epoch.height, photo, [&](size_t i) { return scale.level(score[i]); });
  if (labelled) {
    photo.heat_label =
        sample_map(epoch.width, epoch.height, photo, [&](size_t i) { return label[i]; });
  }
}

}  // namespace

std::vector<EncodedPhoto> encode_photos(const ReportEpoch& epoch, const LevelScale& scale,
                                        const PhotoQuality& quality) {
  std::vector<EncodedPhoto> photos(epoch.photos.size());
  parallel_for(static_cast<int64_t>(photos.size()), 1, [&](int64_t begin, int64_t) {
    const auto i = static_cast<size_t>(begin);
    EncodedPhoto& photo = photos[i];
    photo.width = epoch.width;
    photo.height = epoch.height;
    const Image image = epoch.image ? epoch.image(static_cast<int>(i)) : Image();
    if (image.width > 0 && image.height > 0) encode_image(image, quality, photo);
    if (!epoch.score.empty()) encode_heat(epoch, i, scale, quality, photo);
  });
  return photos;
}

}  // namespace vggtcd
