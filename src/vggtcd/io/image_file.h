// SPDX-License-Identifier: Apache-2.0
// image_file: photos as 8-bit RGB, decoded by OpenCV, HEIC and AVIF by libheif.
// Source: the treatment of alpha is that of VGGT's image loader.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "vggtcd/io/exif.h"
#include "vggtcd/scene/image.h"

namespace vggtcd {

struct ImageReadOptions {
  // Turn the picture the way its EXIF orientation says. The reference does not. HEIC has terms of
  // its own for it, which always hold, and so has AVIF; one without them is turned as EXIF says.
  bool apply_exif_orientation = true;
};

// What a file tells besides its pixels.
struct PhotoFacts {
  Exif exif;
  std::vector<std::string>
      remarks;  // what the user should know of it, each a clause without a name
};

// RGBA is blended onto white: round((c a + 255 (255 - a)) / 255); the alpha of gray and palette
// pictures is dropped. Of 16-bit channels the high byte is taken. A JPEG of more than kMaxPixels
// (picture_header.h) is decoded at a half, a quarter or an eighth of its sides. Whether a file is
// readable its decoder decides: what it complains about becomes a remark. Throws, naming the file,
// Error{kInput} for what it cannot decode, for a file whose data end before the picture does, and
// for what is too large; Error{kMemory} where memory is short. Nothing is printed.
Image read_image(const std::filesystem::path& path, const ImageReadOptions& options = {},
                 PhotoFacts* facts = nullptr);

// The same for a file in memory; `name` stands for it in errors.
Image decode_image(std::span<const std::byte> bytes, const std::string& name,
                   const ImageReadOptions& options = {}, PhotoFacts* facts = nullptr);

// The picture turned so that an EXIF orientation of 1 to 8 becomes 1.
Image turned_upright(Image image, int orientation);

// round((c a + 255 (255 - a)) / 255).
constexpr uint8_t on_white(int value, int alpha) {
  return static_cast<uint8_t>((2 * (value * alpha + 255 * (255 - alpha)) + 255) / 510);
}

}  // namespace vggtcd
