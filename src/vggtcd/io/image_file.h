// SPDX-License-Identifier: Apache-2.0
// image_file: photos as 8-bit RGB, decoded by OpenCV, HEIC and AVIF by libheif.
// Source: the treatment of alpha is that of VGGT's image loader.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

#include "vggtcd/scene/image.h"

namespace vggtcd {

struct ImageReadOptions {
  // Turn the picture the way its EXIF orientation says. The reference does not. HEIC and AVIF have
  // terms of their own for it, which always hold.
  bool apply_exif_orientation = true;
};

// RGBA is blended onto white: round((c a + 255 (255 - a)) / 255); the alpha of gray and palette
// pictures is dropped. Of 16-bit channels the high byte is taken. Throws Error{kInput} for what
// cannot be decoded completely (a cut-off JPEG, too), naming the file.
Image read_image(const std::filesystem::path& path, const ImageReadOptions& options = {});

// The same for a file in memory; `name` stands for it in errors.
Image decode_image(std::span<const std::byte> bytes, const std::string& name,
                   const ImageReadOptions& options = {});

// round((c a + 255 (255 - a)) / 255).
constexpr uint8_t on_white(int value, int alpha) {
  return static_cast<uint8_t>((2 * (value * alpha + 255 * (255 - alpha)) + 255) / 510);
}

}  // namespace vggtcd
