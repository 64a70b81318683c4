// SPDX-License-Identifier: Apache-2.0
// Writing pictures through OpenCV's codecs.
#include "vggtcd/io/image_write.h"

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <span>

#include "vggtcd/core/error.h"
#include "vggtcd/io/output_file.h"

namespace vggtcd {
namespace {

std::vector<std::byte> encode(const Image& image, const char* extension,
                              const std::vector<int>& params) {
  check(image.width > 0 && image.height > 0, "encode: an image has pixels");
  cv::Mat bgr(image.height, image.width, CV_8UC3);
  for (int y = 0; y < image.height; ++y) {
    const uint8_t* from = image.pixel(0, y);
    uint8_t* to = bgr.ptr<uint8_t>(y);
    for (int x = 0; x < image.width; ++x, from += 3, to += 3) {
      to[0] = from[2];
      to[1] = from[1];
      to[2] = from[0];
    }
  }
  std::vector<uchar> bytes;
  check(cv::imencode(extension, bgr, bytes, params), "cv::imencode");
  const auto view = std::as_bytes(std::span(bytes));
  return {view.begin(), view.end()};
}

void write_bytes(const std::filesystem::path& path, const std::vector<std::byte>& bytes) {
  OutputFile file(path);
  file.write(std::span<const std::byte>(bytes));
  file.commit();
}

}  // namespace

std::vector<std::byte> encode_png(const Image& image) {
  return encode(
      image, ".png",
      {cv::IMWRITE_PNG_COMPRESSION, 3, cv::IMWRITE_PNG_STRATEGY, cv::IMWRITE_PNG_STRATEGY_DEFAULT});
}

std::vector<std::byte> encode_jpeg(const Image& image, int quality) {
  check(quality >= 1 && quality <= 100, "encode_jpeg: quality 1 to 100");
  return encode(image, ".jpg", {cv::IMWRITE_JPEG_QUALITY, quality});
}

void write_png(const std::filesystem::path& path, const Image& image) {
  write_bytes(path, encode_png(image));
}

void write_jpeg(const std::filesystem::path& path, const Image& image, int quality) {
  write_bytes(path, encode_jpeg(image, quality));
}

}  // namespace vggtcd
