// SPDX-License-Identifier: Apache-2.0
// Kept files: what a job that was interrupted finds again, known to be whole.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace vggtcd {

// Lists the file or folder `name` of `folder`, which is complete, with sizes and hashes in the file
// kKeptList there. Throws Error{kOutput}.
inline constexpr const char* kKeptList = ".kept";
void keep(const std::filesystem::path& folder, const std::string& name);

// Whether it was kept and is whole. What a killed run had not finished was never kept, and what was
// damaged since is not whole: either has to be made again.
bool is_kept(const std::filesystem::path& folder, const std::string& name);

// The files there that are not as they were kept; the list itself, if that cannot be read.
std::vector<std::string> damaged_files(const std::filesystem::path& folder);

}  // namespace vggtcd
