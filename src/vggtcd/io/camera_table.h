// SPDX-License-Identifier: Apache-2.0
// camera_table: where cameras stood, from the tables that spreadsheets and survey programs save.
#pragma once

#include <filesystem>
#include <vector>

#include "vggtcd/io/reference_cameras.h"

namespace vggtcd {

// docs/formats.md, "Known distances and reference cameras", says what a table may look like. What
// could be read in two ways, and what is said to be no metres, is refused. Throws Error{kInput}
// naming file and line.
std::vector<ReferenceCamera> read_camera_table(const std::filesystem::path& path);

}  // namespace vggtcd
