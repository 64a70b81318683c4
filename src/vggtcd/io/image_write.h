// SPDX-License-Identifier: Apache-2.0
// Writing pictures.
#pragma once

#include <cstddef>
#include <filesystem>
#include <vector>

#include "vggtcd/scene/image.h"

namespace vggtcd {

// The bytes depend on the pixels (and the version of the codec) alone.
std::vector<std::byte> encode_png(const Image& image);
// quality: 1 to 100.
std::vector<std::byte> encode_jpeg(const Image& image, int quality);

// Aside and renamed. Throws Error{kOutput}.
void write_png(const std::filesystem::path& path, const Image& image);
void write_jpeg(const std::filesystem::path& path, const Image& image, int quality);

}  // namespace vggtcd
