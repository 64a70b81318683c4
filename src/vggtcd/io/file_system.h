// SPDX-License-Identifier: Apache-2.0
// The file system, asked and changed without exceptions of the standard library: a folder that may
// not be entered or a link that leads to itself is an answer, or an Error with a sentence. The only
// place besides output_directory.cc and output_file.cc that calls std::filesystem for it
// (scripts/lint_filesystem.py).
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace vggtcd {

// Links are followed. What cannot be reached (no permission, a loop of links) is not there.
bool exists_at(const std::filesystem::path& path);
bool is_file(const std::filesystem::path& path);  // an ordinary one: no pipe, no device
bool is_folder(const std::filesystem::path& path);
bool is_link(const std::filesystem::path& path);  // itself, wherever it leads

// In words, for "expected ..., found ...": kAFile, "a directory", "no such file", "a pipe or a
// device, no ordinary file", "a link that leads nowhere", "nothing that can be reached (Permission
// denied)".
std::string what_stands_at(const std::filesystem::path& path);
inline constexpr std::string_view kAFile = "a file";

// What a folder holds, sorted by name. Throws Error{kInput} if it cannot be listed.
std::vector<std::filesystem::path> list_folder(const std::filesystem::path& folder);
// The same with all folders below; links are not followed.
std::vector<std::filesystem::path> list_tree(const std::filesystem::path& folder);

// Throw Error{kOutput} naming the path. What is to be removed need not be there.
void make_folder(const std::filesystem::path& path);  // and those above it
void remove_tree(const std::filesystem::path& path);  // a file, or a folder with all that is in it
void move_to(const std::filesystem::path& from, const std::filesystem::path& to);
void copy_unless_there(const std::filesystem::path& from, const std::filesystem::path& to);

// Throws Error{kInput}: the size of a file, a path that holds from any folder.
uint64_t size_of_file(const std::filesystem::path& path);
std::filesystem::path absolute_path(const std::filesystem::path& path);
std::filesystem::path without_links(const std::filesystem::path& path);  // of what is there

}  // namespace vggtcd
