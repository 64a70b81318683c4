// SPDX-License-Identifier: Apache-2.0
// What the readers of picture files' headers share: bytes of any offset, and JPEG's segments.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace vggtcd::internal {

inline constexpr std::string_view kPngStart{"\x89PNG\r\n\x1a\n", 8};
inline constexpr std::string_view kJpegStart{"\xff\xd8\xff", 3};

// Numbers that lie outside, in whole or in part, read as 0.
class PictureBytes {
 public:
  explicit PictureBytes(std::string_view bytes) : bytes_(bytes) {}
  explicit PictureBytes(std::span<const std::byte> bytes)
      : bytes_(reinterpret_cast<const char*>(bytes.data()), bytes.size()) {}

  size_t size() const { return bytes_.size(); }
  std::string_view text() const { return bytes_; }
  std::string_view text_at(size_t at, size_t count) const {
    return bytes_.substr(std::min(at, size()), count);
  }
  uint8_t byte(size_t at) const { return at < size() ? static_cast<uint8_t>(bytes_[at]) : 0; }
  uint32_t big_endian(size_t at, size_t count) const {
    uint32_t value = 0;
    if (at > size() || count > size() - at) return 0;
    for (size_t i = 0; i < count; ++i) value = value << 8 | byte(at + i);
    return value;
  }
  uint32_t little_endian(size_t at, size_t count) const {
    uint32_t value = 0;
    if (at > size() || count > size() - at) return 0;
    for (size_t i = count; i > 0; --i) value = value << 8 | byte(at + i - 1);
    return value;
  }

  bool is_jpeg() const { return bytes_.starts_with(kJpegStart); }
  bool is_png() const { return bytes_.starts_with(kPngStart); }
  bool is_webp() const {
    return bytes_.starts_with("RIFF") && bytes_.substr(0, 12).ends_with("WEBP");
  }

 private:
  std::string_view bytes_;
};

// Calls use(marker, data of its segment) for each segment before the first scan's data, that scan's
// header included, until it returns false. As libjpeg does, passes over bytes between segments.
template <typename Use>
void for_each_jpeg_segment(const PictureBytes& file, const Use& use) {
  constexpr uint8_t kStartOfScan = 0xda, kEndOfImage = 0xd9, kTemporary = 0x01;
  for (size_t at = 2; at + 4 <= file.size();) {
    at = file.text().find('\xff', at);
    while (at < file.size() && file.byte(at) == 0xff) ++at;  // any number of fill bytes
    if (at >= file.size()) return;
    const uint8_t marker = file.byte(at++);
    if (marker == 0 || marker == kTemporary || (marker >= 0xd0 && marker <= 0xd7)) continue;
    const size_t length = file.big_endian(at, 2);
    if (marker == kEndOfImage || length < 2 || length > file.size() - at) return;
    if (!use(marker, file.text().substr(at + 2, length - 2)) || marker == kStartOfScan) return;
    at += length;
  }
}

}  // namespace vggtcd::internal
