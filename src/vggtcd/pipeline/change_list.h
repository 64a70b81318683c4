// SPDX-License-Identifier: Apache-2.0
// The list of changed things as files: changes.json, changes.csv (docs/formats.md).
#pragma once

#include <filesystem>

#include "vggtcd/change/instances.h"
#include "vggtcd/pipeline/result_frame.h"

namespace vggtcd {

// Both files into an existing directory. Throws Error{kOutput}.
void write_change_list(const std::filesystem::path& directory, const ChangeInstances& instances,
                       const Reconstruction& before, const Reconstruction& after,
                       const ChangeSet& changes, const ResultFrame& frame);

}  // namespace vggtcd
