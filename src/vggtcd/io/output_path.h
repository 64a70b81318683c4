// SPDX-License-Identifier: Apache-2.0
// Where an output goes: links followed to their end, and names beside it that nobody else has.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace vggtcd {

// The path without symbolic links, ".", ".." and final slashes. A link to what is not there leads
// to where it would be, so that it is made there and the link stays. Throws Error{kOutput} for
// links that lead in a circle.
std::filesystem::path resolve_output(const std::filesystem::path& path);

// "NAME.partial-": how names of what is not complete begin. A long name is cut, its hash tells it
// from others.
std::string partial_prefix(const std::string& name);

// Makes something under the prefix and six random characters, so that processes of one number on
// one volume (containers) do not meet. `make` returns false with errno; EEXIST tries another name.
// Nothing, with errno, if it cannot be made.
std::filesystem::path make_unique(const std::filesystem::path& prefix,
                                  const std::function<bool(const std::filesystem::path&)>& make);

// Whether two names or links are of one file or directory that is there.
bool same_file(const std::filesystem::path& a, const std::filesystem::path& b);
// Whether `path`, which need not be there, is `directory` or below it: by the file system's own
// numbers, so that mounts and letter case do not matter.
bool lies_in(const std::filesystem::path& path, const std::filesystem::path& directory);

}  // namespace vggtcd
