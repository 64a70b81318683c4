// SPDX-License-Identifier: Apache-2.0
// photo_list: folders and files as given by the user -> the list of photos.
#pragma once

#include <filesystem>
#include <span>
#include <vector>

#include "vggtcd/core/progress.h"

namespace vggtcd {

// A folder stands for the photos in it (by extension, not in folders below), in natural order of
// their names: photo_2 before photo_10. A file stands for itself, whatever its extension. Files of
// a folder that are not photos are counted in a notice. Throws Error{kInput} for a path that is not
// there and for a folder without photos.
std::vector<std::filesystem::path> list_photos(std::span<const std::filesystem::path> arguments,
                                               ProgressSink& progress = silent_progress());

// Whether a comes before b: runs of digits compare as numbers, the rest byte by byte.
bool natural_less(std::string_view a, std::string_view b);

}  // namespace vggtcd
