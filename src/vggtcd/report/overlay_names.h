// SPDX-License-Identifier: Apache-2.0
// Names of the overlays of an epoch: detect writes them, view finds them again.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace vggtcd {

// NAME.png for each photo, NAME without its extension; where two photos of the epoch differ in the
// extension only, the extension of all stays in their names. Control characters as \xNN
// (io/quote.h), so that names from a COLMAP model give the same.
std::vector<std::string> overlay_names(std::span<const std::string> photo_names);

}  // namespace vggtcd
