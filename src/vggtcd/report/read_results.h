// SPDX-License-Identifier: Apache-2.0
// What `detect` left in its directory, read back for the report page.
#pragma once

#include <filesystem>

#include "vggtcd/report/report_input.h"

namespace vggtcd {

// Reads summary.json, sim3.json, change.npz, before_aligned.ply, after.ply, colmap/ and, where they
// are, overlays/ and changes.json (docs/formats.md). The pixels of the photos are read from the
// left halves of the overlays when they are asked for; without overlays there are none. Throws
// Error{kInput} naming the file that is missing or does not fit the others.
ReportInput read_results(const std::filesystem::path& directory);

}  // namespace vggtcd
