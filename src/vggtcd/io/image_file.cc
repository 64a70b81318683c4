// SPDX-License-Identifier: Apache-2.0
// image_file: which channels OpenCV is asked for, what it does not tell about bad files, and what
// must not decide how much memory is taken.
#include "vggtcd/io/image_file.h"

#include <algorithm>
#include <cstring>
#include <limits>
#include <new>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string_view>

#include "vggtcd/core/error.h"
#include "vggtcd/io/failure.h"
#include "vggtcd/io/foreign_lines.h"
#include "vggtcd/io/heif_image.h"
#include "vggtcd/io/mapped_file.h"
#include "vggtcd/io/picture_bytes.h"
#include "vggtcd/io/picture_header.h"

namespace vggtcd {
namespace {

using internal::kJpegStart;
using internal::kPngStart;

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

struct Decoded {
  cv::Mat picture;                 // empty: it cannot be decoded
  std::vector<std::string> lines;  // what the decoder said
  bool out_of_memory = false;
};

bool any_line_has(const std::vector<std::string>& lines, std::string_view words) {
  return std::ranges::any_of(
      lines, [&](const std::string& line) { return line.find(words) != std::string::npos; });
}

Decoded decode(std::string_view file, int flags) {
  // OpenCV only reads from it.
  const cv::Mat bytes(1, static_cast<int>(file.size()), CV_8UC1, const_cast<char*>(file.data()));
  Decoded result;
  const ForeignLines foreign;
  try {
    result.picture = cv::imdecode(bytes, flags);
  } catch (const cv::Exception& error) {
    result.out_of_memory = error.code == cv::Error::StsNoMem;
  }
  result.lines = foreign.lines();
  for (const char* words : {"Insufficient memory", "Failed to allocate", "Out of memory"}) {
    result.out_of_memory |= result.picture.empty() && any_line_has(result.lines, words);
  }
  return result;
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

// The sentence behind "too large" and the like.
std::string size_in_words(const PictureHeader& header) {
  return fmt::format("{} x {} px ({} megapixels)", header.width, header.height,
                     header.pixels() / 1'000'000);
}

class Decoder {
 public:
  Decoder(std::string_view file, const std::string& name, PhotoFacts& facts)
      : file_(file),
        name_(name),
        facts_(facts),
        header_(read_picture_header(std::as_bytes(std::span(file)))) {}

  Image decode() {
    if (file_.starts_with(kJpegStart)) return decode_jpeg();
    if (header_ && header_->pixels() > kMaxPixels) too_large("save it smaller, or as JPEG");
    if (is_rgba_png(file_) || !file_.starts_with(kPngStart)) {
      const cv::Mat picture = take(vggtcd::decode(file_, cv::IMREAD_UNCHANGED), false);
      // What could not be decoded has a type, too.
      const bool rgba = !picture.empty() && picture.channels() == 4 &&
                        (picture.depth() == CV_8U || picture.depth() == CV_16U);
      if (rgba) return rgb_on_white(picture);
      if (!picture.empty() && picture.type() == CV_16UC3) {
        return rgb_from_bgr(high_bytes(picture));
      }
    }
    return decode_color(file_, cv::IMREAD_COLOR);
  }

 private:
  [[noreturn]] void fail(std::string_view why) const {
    throw_error(ErrorCode::kInput, "{}: not a readable photo: {}", name_, why);
  }
  [[noreturn]] void too_large(std::string_view remedy) const {
    throw_error(ErrorCode::kInput, "{}: too large: expected at most {} megapixels, found {}; {}",
                name_, kMaxPixels / 1'000'000, size_in_words(*header_), remedy);
  }

  // The picture, and what its decoder said as remarks.
  cv::Mat take(const Decoded& decoded, bool required = true) {
    lines_ = decoded.lines;
    if (decoded.out_of_memory) throw std::bad_alloc();
    if (decoded.picture.empty() && required) fail(why_not_an_image(file_));
    if (!decoded.picture.empty() && !decoded.lines.empty()) {
      facts_.remarks.push_back(fmt::format(
          "its decoder says \"{}\"{}", decoded.lines.front(),
          decoded.lines.size() > 1 ? fmt::format(" and {} more", decoded.lines.size() - 1) : ""));
    }
    return decoded.picture;
  }

  Image decode_color(std::string_view file, int flags) {
    const cv::Mat picture = take(vggtcd::decode(file, flags | cv::IMREAD_IGNORE_ORIENTATION));
    check(picture.type() == CV_8UC3, "OpenCV decodes to 8-bit BGR");
    return rgb_from_bgr(picture);
  }

  Image decode_jpeg() {
    const int reduction = header_ ? jpeg_reduction(*header_) : 1;
    if (reduction == 0) too_large("save it smaller");
    const int flags = reduction == 8   ? cv::IMREAD_REDUCED_COLOR_8
                      : reduction == 4 ? cv::IMREAD_REDUCED_COLOR_4
                      : reduction == 2 ? cv::IMREAD_REDUCED_COLOR_2
                                       : cv::IMREAD_COLOR;
    // OpenCV fills a picture whose data run out and says nothing. Data that run into an end marker
    // libjpeg complains about, so there are some behind the data: more than a segment that is cut
    // off can swallow.
    constexpr size_t kMarkers = 40'000;
    std::string with_end(file_);
    with_end.reserve(file_.size() + 2 * kMarkers);
    for (size_t i = 0; i < kMarkers; ++i) with_end += "\xff\xd9";
    Image image = decode_color(with_end, flags);
    if (lines_.empty()) return with_remark_on(reduction, std::move(image));
    // libjpeg prints its first complaint only, so data that ran out may hide behind another one.
    // Then the picture depends on the markers.
    if (decode_alone(flags).rgb != image.rgb) fail(why_not_an_image(file_));
    if (any_line_has(lines_, "remature end of")) {
      facts_.remarks = {
          "part of the picture is damaged or missing in the file; copy it again, or leave it out"};
    }
    return with_remark_on(reduction, std::move(image));
  }

  Image decode_alone(int flags) const {
    PhotoFacts unused;
    return Decoder(file_, name_, unused).decode_color(file_, flags);
  }

  Image with_remark_on(int reduction, Image image) {
    if (reduction > 1) {
      facts_.remarks.push_back(fmt::format("its {} are decoded at 1/{} of the sides",
                                           size_in_words(*header_), reduction));
    }
    return image;
  }

  std::string_view file_;
  const std::string& name_;
  PhotoFacts& facts_;
  std::optional<PictureHeader> header_;
  std::vector<std::string> lines_;  // of the last decoding
};

// Cameras are taken for pinholes, which a picture all around is not.
void remark_on_panorama(std::string_view file, const Image& image, PhotoFacts& facts) {
  constexpr size_t kHeaderBytes = 1 << 18;  // XMP stands in front
  constexpr int kLeastHeight = 1000;        // px; 2 : 1 alone is no proof for a small picture
  const std::string_view front = file.substr(0, kHeaderBytes);
  const bool says_so = front.find("ProjectionType") != std::string_view::npos &&
                       front.find("equirectangular") != std::string_view::npos;
  if (!says_so && (image.width != 2 * image.height || image.height < kLeastHeight)) return;
  facts.remarks.push_back(fmt::format(
      "{} all around (equirectangular, 2 : 1), which no camera model here fits; cut ordinary views "
      "out of it",
      says_so ? "it is a panorama" : "its shape is that of a panorama"));
}

Image decode_any(std::span<const std::byte> bytes, const std::string& name,
                 const ImageReadOptions& options, PhotoFacts& facts) {
  const std::string_view file(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (is_heif(bytes)) {
    const ForeignLines foreign;
    return decode_heif(bytes, name, options, facts);
  }
  facts.exif = read_exif(bytes);
  Image image = Decoder(file, name, facts).decode();
  return turned_upright(std::move(image),
                        options.apply_exif_orientation ? facts.exif.orientation : 1);
}

}  // namespace

Image turned_upright(Image image, int orientation) {
  if (orientation <= 1 || orientation > 8) return image;
  const bool transposed = orientation >= 5;
  Image result = transposed ? Image(image.height, image.width) : Image(image.width, image.height);
  const cv::Mat from(image.height, image.width, CV_8UC3, image.rgb.data());
  cv::Mat to(result.height, result.width, CV_8UC3, result.rgb.data());
  constexpr int kNone = 2, kUpsideDown = 0, kSideways = 1, kBoth = -1;  // cv::flip's codes
  constexpr int kFlip[] = {kNone, kNone,     kSideways, kBoth,      kUpsideDown,
                           kNone, kSideways, kBoth,     kUpsideDown};
  if (transposed) {
    cv::transpose(from, to);
    if (kFlip[orientation] != kNone) cv::flip(to, to, kFlip[orientation]);
  } else {
    cv::flip(from, to, kFlip[orientation]);
  }
  return result;
}

Image decode_image(std::span<const std::byte> bytes, const std::string& name,
                   const ImageReadOptions& options, PhotoFacts* facts) {
  PhotoFacts unasked;
  PhotoFacts& found = facts != nullptr ? *facts : unasked;
  found = {};
  const std::string_view file(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (file.empty() || file.size() >= size_t{std::numeric_limits<int>::max()}) {
    throw_error(ErrorCode::kInput, "{}: not a readable photo: {}", name,
                file.empty() ? why_not_an_image(file) : "larger than 2 GB");
  }
  try {
    Image image = decode_any(bytes, name, options, found);
    remark_on_panorama(file, image, found);
    return image;
  } catch (const std::bad_alloc&) {
    const auto header = read_picture_header(bytes);
    throw_error(ErrorCode::kMemory,
                "{}: does not fit into memory{}; use smaller photos, or fewer "
                "threads (--threads)",
                name, header ? ": " + size_in_words(*header) : "");
  }
}

Image read_image(const std::filesystem::path& path, const ImageReadOptions& options,
                 PhotoFacts* facts) try {
  // Not mapped: a photo that is written anew meanwhile would end the process.
  return decode_image(read_file_bytes(path), path.string(), options, facts);
} catch (...) {
  rethrow_naming(path);
}

}  // namespace vggtcd
