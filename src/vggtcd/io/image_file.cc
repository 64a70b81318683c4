// SPDX-License-Identifier: Apache-2.0
// image_file: which channels OpenCV is asked for, and what it does not tell about bad files.
#include "vggtcd/io/image_file.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <opencv2/core/mat.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string_view>

#include "vggtcd/core/error.h"
#include "vggtcd/io/failure.h"
#include "vggtcd/io/heif_image.h"
#include "vggtcd/io/mapped_file.h"

namespace vggtcd {
namespace {

constexpr std::string_view kPngStart{"\x89PNG\r\n\x1a\n", 8};
constexpr std::string_view kJpegStart{"\xff\xd8\xff", 3};

uint8_t byte_at(std::string_view file, size_t at) { return static_cast<uint8_t>(file[at]); }

// Follows the markers of a JPEG file to its end-of-image: a decoder fills what is cut off with gray
// and says nothing. (Bytes after the end are common: phones append videos.)
bool is_complete_jpeg(std::string_view file) {
  constexpr uint8_t kEndOfImage = 0xd9, kStartOfScan = 0xda;
  size_t at = 2;
  while (at + 4 <= file.size()) {
    if (byte_at(file, at) != 0xff) return false;
    const uint8_t marker = byte_at(file, at + 1);
    if (marker == 0xff) {  // fill byte
      ++at;
      continue;
    }
    at += 2 + 256u * byte_at(file, at + 2) + byte_at(file, at + 3);
    if (marker != kStartOfScan) continue;
    // Coded data: 0xff is followed by 0 (a data byte) or by a restart marker, else it ends here.
    while (at + 2 <= file.size()) {
      const size_t next = file.find('\xff', at);
      if (next == std::string_view::npos || next + 1 >= file.size()) return false;
      const uint8_t code = byte_at(file, next + 1);
      if (code == kEndOfImage) return true;
      const bool data = code == 0 || (code >= 0xd0 && code <= 0xd7);
      at = next + (data ? 2u : 0u);
      if (!data) break;
    }
  }
  return false;
}

// Likewise for PNG, chunk by chunk: libpng would print a line of its own.
bool is_complete_png(std::string_view file) {
  constexpr size_t kChunkOverhead = 12;  // length, name, CRC
  size_t at = kPngStart.size();
  while (at + kChunkOverhead <= file.size()) {
    const size_t length = size_t{byte_at(file, at)} << 24 | size_t{byte_at(file, at + 1)} << 16 |
                          size_t{byte_at(file, at + 2)} << 8 | size_t{byte_at(file, at + 3)};
    if (length > file.size() - at - kChunkOverhead) return false;
    if (file.substr(at + 4, 4) == "IEND") return true;
    at += kChunkOverhead + length;
  }
  return false;
}

// Formats that a phone or a failed download leaves and that no decoder here knows.
std::string_view why_not_an_image(std::string_view file) {
  if (file.empty()) return "the file is empty; copy it again";
  const std::string_view start = file.substr(0, 64);
  if (start.substr(std::min<size_t>(4, start.size())).starts_with("ftyp")) {
    return "a video, or a picture in a container that is not known; save it as JPEG or PNG";
  }
  const size_t text = start.find_first_not_of(" \t\r\n");
  if (text != std::string_view::npos && start[text] == '<') return "found a web page or SVG";
  if (file.starts_with(kJpegStart) || file.starts_with(kPngStart)) {
    return "the file is cut off or damaged; copy it again";
  }
  return "not an image that can be decoded; expected JPEG, PNG, WebP, TIFF or similar";
}

// A PNG of colour type 6. Gray with alpha and palettes with transparency are not: their alpha goes.
bool is_rgba_png(std::string_view file) {
  constexpr size_t kColorTypeAt = 25;
  return file.starts_with(kPngStart) && file.size() > kColorTypeAt && file[kColorTypeAt] == 6;
}

cv::Mat decode(std::string_view file, int flags) {
  // OpenCV only reads from it.
  const cv::Mat bytes(1, static_cast<int>(file.size()), CV_8UC1, const_cast<char*>(file.data()));
  try {
    return cv::imdecode(bytes, flags);
  } catch (const cv::Exception& error) {
    if (error.code == cv::Error::StsNoMem) throw;
    return {};
  }
}

Image rgb_from_bgr(const cv::Mat& bgr) {
  Image image(bgr.cols, bgr.rows);
  for (int y = 0; y < bgr.rows; ++y) {
    const uint8_t* from = bgr.ptr<uint8_t>(y);
    uint8_t* to = image.pixel(0, y);
    for (int x = 0; x < bgr.cols; ++x, from += 3, to += 3) {
      to[0] = from[2];
      to[1] = from[1];
      to[2] = from[0];
    }
  }
  return image;
}

// The high bytes; OpenCV's own reduction to 8 bits takes them for PNG, but rounds for TIFF.
cv::Mat high_bytes(const cv::Mat& picture) {
  cv::Mat bytes(picture.size(), CV_MAKETYPE(CV_8U, picture.channels()));
  for (int y = 0; y < picture.rows; ++y) {
    const uint16_t* from = picture.ptr<uint16_t>(y);
    std::transform(from, from + picture.cols * picture.channels(), bytes.ptr<uint8_t>(y),
                   [](uint16_t value) { return static_cast<uint8_t>(value >> 8); });
  }
  return bytes;
}

Image rgb_on_white(const cv::Mat& bgra) {
  Image image(bgra.cols, bgra.rows);
  const bool wide = bgra.depth() == CV_16U;
  const auto channel = [&](int y, int x, int c) -> int {
    return wide ? bgra.ptr<uint16_t>(y)[4 * x + c] >> 8 : bgra.ptr<uint8_t>(y)[4 * x + c];
  };
  for (int y = 0; y < bgra.rows; ++y) {
    uint8_t* to = image.pixel(0, y);
    for (int x = 0; x < bgra.cols; ++x) {
      const int alpha = channel(y, x, 3);
      for (int c = 2; c >= 0; --c) *to++ = on_white(channel(y, x, c), alpha);
    }
  }
  return image;
}

}  // namespace

Image decode_image(std::span<const std::byte> bytes, const std::string& name,
                   const ImageReadOptions& options) {
  const std::string_view file(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  const auto fail = [&](std::string_view why) {
    throw_error(ErrorCode::kInput, "{}: not a readable photo: {}", name, why);
  };
  if (file.empty()) fail(why_not_an_image(file));
  if (file.size() > size_t{std::numeric_limits<int>::max()}) fail("larger than 2 GB");
  if (is_heif(bytes)) return decode_heif(bytes, name);
  const bool jpeg = file.starts_with(kJpegStart);
  const bool png = file.starts_with(kPngStart);
  if ((jpeg && !is_complete_jpeg(file)) || (png && !is_complete_png(file))) {
    fail(why_not_an_image(file));
  }
  if (is_rgba_png(file) || (!jpeg && !png)) {
    const cv::Mat picture = decode(file, cv::IMREAD_UNCHANGED);
    const bool rgba =
        picture.channels() == 4 && (picture.depth() == CV_8U || picture.depth() == CV_16U);
    if (rgba) return rgb_on_white(picture);
    if (picture.type() == CV_16UC3) return rgb_from_bgr(high_bytes(picture));
  }
  int flags = cv::IMREAD_COLOR;
  if (!options.apply_exif_orientation) flags |= cv::IMREAD_IGNORE_ORIENTATION;
  const cv::Mat picture = decode(file, flags);
  if (picture.empty()) fail(why_not_an_image(file));
  check(picture.type() == CV_8UC3, "OpenCV decodes to 8-bit BGR");
  return rgb_from_bgr(picture);
}

Image read_image(const std::filesystem::path& path, const ImageReadOptions& options) try {
  const MappedFile file(path);
  return decode_image(file.bytes(), path.string(), options);
} catch (...) {
  rethrow_naming(path);
}

}  // namespace vggtcd
