// SPDX-License-Identifier: Apache-2.0
// HEIC and AVIF photos as 8-bit RGB, decoded by libheif where the build has it.
#pragma once

#include <cstddef>
#include <span>
#include <string>

#include "vggtcd/io/image_file.h"

namespace vggtcd {

// Whether the file says that it is a HEIF picture: its first box names a brand of HEIC or AVIF.
bool is_heif(std::span<const std::byte> file);

// The primary picture as its own transformations (turned, mirrored, cropped) show it; the EXIF
// orientation, which phones write as well, is not applied a second time. An AVIF without such
// transformations, as converters leave it, is turned as EXIF says if the options want it. 10 and 12
// bits are reduced to 8, alpha is blended onto white. Throws Error{kInput} naming the file if it
// cannot be decoded completely or is too large, Error{kUnavailable} in a build without libheif.
Image decode_heif(std::span<const std::byte> file, const std::string& name,
                  const ImageReadOptions& options, PhotoFacts& facts);

}  // namespace vggtcd
