// SPDX-License-Identifier: Apache-2.0
// The sizes that headers of picture files claim.
#include "vggtcd/io/picture_header.h"

#include <algorithm>
#include <charconv>

#include "vggtcd/io/picture_bytes.h"

namespace vggtcd {
namespace {

using internal::PictureBytes;

std::optional<PictureHeader> of_jpeg(const PictureBytes& file) {
  std::optional<PictureHeader> header;
  uint8_t components = 0;
  internal::for_each_jpeg_segment(file, [&](uint8_t marker, std::string_view data) {
    constexpr uint8_t kStartOfScan = 0xda, kProgressive = 0xc2, kProgressiveArithmetic = 0xca;
    const bool is_frame =
        marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
    const PictureBytes segment(data);
    if (is_frame && !header) {
      header = {segment.big_endian(3, 2), segment.big_endian(1, 2),
                marker == kProgressive || marker == kProgressiveArithmetic};
      components = segment.byte(5);
    }
    if (marker == kStartOfScan && header) header->in_scans |= segment.byte(0) < components;
    return true;
  });
  return header;
}

std::optional<PictureHeader> of_webp(const PictureBytes& file) {
  constexpr size_t kChunk = 12, kData = 20;
  const std::string_view kind = file.text_at(kChunk, 4);
  if (kind == "VP8X") {
    return PictureHeader{1 + int64_t{file.little_endian(kData + 4, 3)},
                         1 + int64_t{file.little_endian(kData + 7, 3)}};
  }
  if (kind == "VP8L") {
    const uint32_t bits = file.little_endian(kData + 1, 4);
    return PictureHeader{1 + int64_t{bits & 0x3fff}, 1 + int64_t{bits >> 14 & 0x3fff}};
  }
  if (kind == "VP8 ") {
    return PictureHeader{file.little_endian(kData + 6, 2) & 0x3fff,
                         file.little_endian(kData + 8, 2) & 0x3fff};
  }
  return std::nullopt;
}

// The first directory, which is what is decoded.
std::optional<PictureHeader> of_tiff(const PictureBytes& file) {
  const bool big = file.text().starts_with("MM");
  const auto number = [&](size_t at, size_t size) {
    return big ? file.big_endian(at, size) : file.little_endian(at, size);
  };
  if (number(2, 2) != 42) return std::nullopt;
  const size_t directory = number(4, 4), count = number(directory, 2);
  PictureHeader header;
  for (size_t i = 0; i < count && directory + 2 + 12 * (i + 1) <= file.size(); ++i) {
    constexpr uint32_t kWidth = 256, kHeight = 257, kShort = 3;
    const size_t field = directory + 2 + 12 * i;
    const uint32_t value = number(field + 8, number(field + 2, 2) == kShort ? 2 : 4);
    if (number(field, 2) == kWidth) header.width = value;
    if (number(field, 2) == kHeight) header.height = value;
  }
  return header;
}

// "P6 # comment \n 640 480": the first two numbers.
std::optional<PictureHeader> of_pnm(std::string_view text) {
  text = text.substr(2, 4096);
  int64_t numbers[2] = {0, 0};
  for (int64_t& number : numbers) {
    while (!text.empty() && (text[0] < '0' || text[0] > '9')) {
      const size_t skip = text[0] == '#' ? text.find('\n') : 1;
      text.remove_prefix(std::min(skip, text.size()));
    }
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc()) return std::nullopt;
    text.remove_prefix(static_cast<size_t>(end - text.data()));
  }
  return PictureHeader{numbers[0], numbers[1]};
}

std::optional<PictureHeader> of_jpeg2000(const PictureBytes& file) {
  const size_t box = file.text().substr(0, 4096).find("ihdr");
  if (box == std::string_view::npos) return std::nullopt;
  return PictureHeader{file.big_endian(box + 8, 4), file.big_endian(box + 4, 4)};
}

// The largest of its pictures and tiles: the whole picture of a grid is one of them.
std::optional<PictureHeader> of_heif(const PictureBytes& file) {
  const std::string_view boxes = file.text().substr(0, file.text().find("mdat"));
  std::optional<PictureHeader> largest;
  for (size_t at = 0; (at = boxes.find("ispe", at)) != std::string_view::npos; at += 4) {
    const PictureHeader size{file.big_endian(at + 8, 4), file.big_endian(at + 12, 4)};
    if (!largest || size.pixels() > largest->pixels()) largest = size;
  }
  return largest;
}

}  // namespace

int64_t PictureHeader::pixels() const {
  constexpr int64_t kMaxSide = int64_t{1}
                               << 20;  // of OpenCV; a longer one counts as if both were so
  return std::max(width, height) > kMaxSide ? kMaxSide * kMaxSide : width * height;
}

std::optional<PictureHeader> read_picture_header(std::span<const std::byte> bytes) {
  const PictureBytes file(bytes);
  const std::string_view text = file.text();
  std::optional<PictureHeader> header;
  if (file.is_jpeg()) {
    header = of_jpeg(file);
  } else if (file.is_png()) {
    header = {file.big_endian(16, 4), file.big_endian(20, 4)};
  } else if (file.is_webp()) {
    header = of_webp(file);
  } else if (text.starts_with("II*") || text.starts_with("MM")) {
    header = of_tiff(file);
  } else if (text.starts_with("BM")) {
    const auto height = static_cast<int32_t>(file.little_endian(22, 4));  // < 0: from the top
    header = {static_cast<int32_t>(file.little_endian(18, 4)), std::abs(int64_t{height})};
  } else if (text.size() > 2 && text[0] == 'P' && text[1] >= '1' && text[1] <= '6') {
    header = of_pnm(text);
  } else if (file.text_at(4, 4) == "jP  ") {
    header = of_jpeg2000(file);
  } else if (file.text_at(4, 4) == "ftyp") {
    header = of_heif(file);
  }
  if (header && (header->width < 1 || header->height < 1)) header.reset();
  return header;
}

int jpeg_reduction(const PictureHeader& header) {
  constexpr int64_t kLargestThatIsUsed = 4096;         // px; photos are reduced to less than this
  constexpr int64_t kDecoderLimit = int64_t{1} << 30;  // px, of OpenCV
  const int64_t pixels = header.pixels();
  if (pixels <= kMaxPixels) return 1;
  if (header.in_scans || pixels > kDecoderLimit) return 0;
  for (const int reduction : {8, 4, 2}) {
    const bool enough = std::max(header.width, header.height) >= kLargestThatIsUsed * reduction;
    if (enough || reduction == 2) return reduction;
  }
  return 0;
}

int64_t decode_bytes(std::span<const std::byte> bytes) {
  const PictureBytes file(bytes);
  const auto header = read_picture_header(bytes);
  const auto in_file = static_cast<int64_t>(bytes.size());
  if (!header) return 2 * in_file;
  // px twice in RGB, as the decoder gives them and as we keep them; a JPEG in scans also has three
  // coefficients of two bytes each. What other decoders give is copied from up to eight bytes a px.
  constexpr int64_t kRgb = 3, kCoefficients = 6, kWidestPixel = 8;
  const int64_t pixels = header->pixels();
  if (!file.is_jpeg()) return in_file + pixels * (kRgb + kWidestPixel);
  const int reduction = std::max(1, jpeg_reduction(*header));
  const int64_t decoded = pixels / (reduction * reduction);
  return 2 * in_file + decoded * 2 * kRgb + (header->in_scans ? pixels * kCoefficients : 0);
}

}  // namespace vggtcd
