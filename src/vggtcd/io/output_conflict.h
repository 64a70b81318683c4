// SPDX-License-Identifier: Apache-2.0
// Outputs that would stand on inputs are refused before any work.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace vggtcd {

// Inputs are files, folders, or patterns of photos (photo_source.h), as a user names them. Empty
// ones, and those that are not there, are left to their readers. All throw Error{kOutput} in a line
// that names both and the remedy.

// The directory `out` may not hold an input (nor one to which a link in an input folder leads), be
// one, or lie in one.
void require_directory_apart(const std::filesystem::path& out,
                             const std::vector<std::string>& inputs);

// The file `out` may not be an input, match one, or lie in one.
void require_file_apart(const std::filesystem::path& out, const std::vector<std::string>& inputs);

// The file `out` may lie in the directory of results that is read, but not be one of its files.
void require_no_result(const std::filesystem::path& out, const std::filesystem::path& results);

}  // namespace vggtcd
