// SPDX-License-Identifier: Apache-2.0
// EXIF: two directories of TIFF fields, every offset looked at before it is followed.
#include "vggtcd/io/exif.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <string_view>

#include "vggtcd/io/picture_bytes.h"

namespace vggtcd {
namespace {

using internal::PictureBytes;

constexpr std::string_view kExifStart{"Exif\0\0", 6};

// A TIFF structure of either byte order; what lies outside reads as 0.
class TiffBlock {
 public:
  explicit TiffBlock(std::string_view bytes)
      : bytes_(bytes), big_endian_(bytes.starts_with("MM")) {}

  bool is_valid() const {
    return (bytes_.text().starts_with("II") || big_endian_) && number(2, 2) == 42;
  }
  uint32_t number(size_t at, size_t size) const {
    return big_endian_ ? bytes_.big_endian(at, size) : bytes_.little_endian(at, size);
  }

  // Calls use(tag, type, count, offset of the value) for each field of the directory.
  template <typename Use>
  void for_each_field(size_t directory, const Use& use) const {
    constexpr size_t kFieldBytes = 12;
    const size_t count = number(directory, 2);
    for (size_t i = 0; i < count; ++i) {
      const size_t field = directory + 2 + i * kFieldBytes;
      if (field + kFieldBytes > bytes_.size()) return;
      const uint32_t type = number(field + 2, 2), values = number(field + 4, 4);
      const size_t value_bytes = size_of(type) * values;
      use(number(field, 2), type, values, value_bytes <= 4 ? field + 8 : number(field + 8, 4));
    }
  }
  std::string text(size_t at, size_t count) const {
    constexpr size_t kMaxText = 64;
    const std::string_view whole = bytes_.text().substr(std::min(at, bytes_.size()));
    const std::string_view text = whole.substr(0, std::min(count, kMaxText));
    return std::string(text.substr(0, text.find('\0')));
  }
  double rational(size_t at) const {
    const uint32_t below = number(at + 4, 4);
    return below == 0 ? 0.0 : static_cast<double>(number(at, 4)) / below;
  }

 private:
  static size_t size_of(uint32_t type) {
    constexpr size_t kSizes[] = {0, 1, 1, 2, 4, 8, 1, 1, 2, 4, 8, 4, 8};
    return type < std::size(kSizes) ? kSizes[type] : 0;
  }
  PictureBytes bytes_;
  bool big_endian_;
};

constexpr uint32_t kAscii = 2, kShort = 3, kRational = 5;

void take_camera_field(const TiffBlock& tiff, uint32_t tag, uint32_t type, uint32_t count,
                       size_t at, Exif& exif) {
  if (type == kRational && tag == 0x920a) exif.focal_mm = tiff.rational(at);
  if (type == kRational && tag == 0xa404) exif.digital_zoom = tiff.rational(at);
  if (type == kShort && tag == 0xa405) exif.focal_35mm = tiff.number(at, 2);
  if (type == kAscii && tag == 0xa434) exif.lens = tiff.text(at, count);
}

std::string_view exif_of_jpeg(const PictureBytes& file) {
  std::string_view found;
  internal::for_each_jpeg_segment(file, [&](uint8_t marker, std::string_view data) {
    constexpr uint8_t kApp1 = 0xe1, kStartOfScan = 0xda;
    if (marker == kApp1 && data.starts_with(kExifStart)) found = data;
    return found.empty() && marker != kStartOfScan;
  });
  return found;
}

std::string_view exif_of_png(const PictureBytes& file) {
  constexpr size_t kOverhead = 12;  // length, name, CRC
  for (size_t at = internal::kPngStart.size(); at + kOverhead <= file.size();) {
    const size_t length = file.big_endian(at, 4);
    if (length > file.size() - at - kOverhead) return {};
    if (file.text_at(at + 4, 4) == "eXIf") return file.text_at(at + 8, length);
    at += kOverhead + length;
  }
  return {};
}

std::string_view exif_of_webp(const PictureBytes& file) {
  for (size_t at = 12; at + 8 <= file.size();) {
    const size_t length = file.little_endian(at + 4, 4);
    if (length > file.size() - at - 8) return {};
    if (file.text_at(at, 4) == "EXIF") return file.text_at(at + 8, length);
    at += 8 + length + length % 2;
  }
  return {};
}

}  // namespace

std::string Exif::camera() const {
  const bool known =
      !make.empty() || !model.empty() || !lens.empty() || focal_mm > 0 || focal_35mm > 0;
  if (!known) return "";
  // A zoom lens tells its focal length to a tenth of a millimetre or so: same place of the ring.
  return fmt::format("{}|{}|{}|{:.3g}|{:.3g}|{:.3g}", make, model, lens, focal_mm, focal_35mm,
                     digital_zoom > 1 ? digital_zoom : 0.0);
}

Exif parse_exif(std::span<const std::byte> block) {
  std::string_view bytes(reinterpret_cast<const char*>(block.data()), block.size());
  if (bytes.starts_with(kExifStart)) bytes.remove_prefix(kExifStart.size());
  const TiffBlock tiff(bytes);
  Exif exif;
  if (!tiff.is_valid()) return exif;
  size_t camera_fields = 0;
  tiff.for_each_field(
      tiff.number(4, 4), [&](uint32_t tag, uint32_t type, uint32_t count, size_t at) {
        constexpr uint32_t kMake = 0x010f, kModel = 0x0110, kOrientation = 0x0112, kExif = 0x8769;
        if (type == kAscii && tag == kMake) exif.make = tiff.text(at, count);
        if (type == kAscii && tag == kModel) exif.model = tiff.text(at, count);
        if (tag == kOrientation && type == kShort) {
          const uint32_t orientation = tiff.number(at, 2);
          if (orientation >= 1 && orientation <= 8)
            exif.orientation = static_cast<int>(orientation);
        }
        if (tag == kExif) camera_fields = tiff.number(at, 4);
      });
  if (camera_fields > 0) {
    tiff.for_each_field(camera_fields, [&](uint32_t tag, uint32_t type, uint32_t count, size_t at) {
      take_camera_field(tiff, tag, type, count, at, exif);
    });
  }
  return exif;
}

Exif read_exif(std::span<const std::byte> file) {
  const PictureBytes bytes(file);
  const std::string_view block = bytes.is_jpeg()   ? exif_of_jpeg(bytes)
                                 : bytes.is_png()  ? exif_of_png(bytes)
                                 : bytes.is_webp() ? exif_of_webp(bytes)
                                                   : std::string_view();
  return parse_exif(std::as_bytes(std::span(block)));
}

}  // namespace vggtcd
