// SPDX-License-Identifier: Apache-2.0
// file_bytes: a whole file in memory, for the small files of users: models, tables, JSON.
#pragma once

#include <filesystem>
#include <string>

namespace vggtcd {

// Throws Error{kInput} naming the path if it does not exist, may not be read or is no ordinary file
// (a folder, a pipe, a device). Can be interrupted.
std::string read_file_bytes(const std::filesystem::path& path);

}  // namespace vggtcd
