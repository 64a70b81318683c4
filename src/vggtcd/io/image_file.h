// SPDX-License-Identifier: Apache-2.0
// image_file: photos as 8-bit RGB, decoded by OpenCV.
// Source: the treatment of alpha is that of VGGT's image loader.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "vggtcd/scene/image.h"

namespace vggtcd {

struct ImageReadOptions {
  // Turn the picture the way its EXIF orientation says. The reference does not.
  bool apply_exif_orientation = true;
};

// RGBA is blended onto white: round((c a + 255 (255 - a)) / 255); the alpha of gray and palette
// pictures is dropped. Of 16-bit channels the high byte is taken. Throws Error{kInput} for what
// cannot be decoded completely (a cut-off JPEG, too), naming the file.
Image read_image(const std::filesystem::path& path, const ImageReadOptions& options = {});

// The same for a file in memory; `name` stands for it in errors.
Image decode_image(std::span<const std::byte> bytes, const std::string& name,
                   const ImageReadOptions& options = {});

}  // namespace vggtcd
