// SPDX-License-Identifier: Apache-2.0
// How large a picture is and what decoding it takes, from its header alone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace vggtcd {

struct PictureHeader {
  int64_t width = 0, height = 0;  // px, as stored
  // JPEG whose picture comes in several scans: its decoder keeps all coefficients, so it cannot
  // save memory by decoding smaller.
  bool in_scans = false;

  int64_t pixels() const;
};

// Of a JPEG, PNG, WebP, TIFF, BMP, PNM, JPEG 2000, HEIC or AVIF file; nothing for other formats and
// for a header that is cut off.
std::optional<PictureHeader> read_picture_header(std::span<const std::byte> file);

// What is decoded whole; beyond, a JPEG is decoded smaller and other formats are refused.
inline constexpr int64_t kMaxPixels = int64_t{1} << 28;

// By what a JPEG is reduced while it is decoded: 1 (not) for all up to kMaxPixels; above 2, 4 or 8,
// so that its longer side stays larger than anything here needs; 0 where no reduction helps.
int jpeg_reduction(const PictureHeader& header);

// Memory that reading such a file takes at its peak, the picture included.
int64_t decode_bytes(std::span<const std::byte> file);

}  // namespace vggtcd
