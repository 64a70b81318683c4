// SPDX-License-Identifier: Apache-2.0
// Writing photos as JPEG.
#pragma once

#include <filesystem>

#include "vggtcd/scene/image.h"

namespace vggtcd {

// Baseline JPEG, quality 1 to 100. The bytes depend on the pixels
// and the quality alone. Written aside and renamed. Throws Error{kOutput}.
void write_jpeg(const std::filesystem::path& path, const Image& image, int quality);

}  // namespace vggtcd
