// SPDX-License-Identifier: Apache-2.0
// PartialDirectory: where results are written until they are complete, and how what a killed
// process left there is told from what somebody else keeps under such a name.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "vggtcd/io/file_lock.h"

namespace vggtcd {

// A directory of that kind holds a note with its own name and the names of what will be written
// into it; the note is locked while its process lives. A name alone says nothing: without such a
// note, with a note of another name (a copy, renamed) or with anything in it that the note does not
// name, a directory is left alone.
struct PartialDirectory {
  static constexpr std::string_view kNote = ".vggt-cd-partial";

  std::filesystem::path path;
  FileLock lock;  // on the note

  // "TARGET.partial-XXXXXX" beside the target, or ".vggt-cd-partial-XXXXXX" in it, with random
  // letters. `names` as in OutputContents. Throws Error{kOutput} naming the target.
  static PartialDirectory make_beside(const std::filesystem::path& target,
                                      const std::vector<std::string>& names);
  static PartialDirectory make_in(const std::filesystem::path& target,
                                  const std::vector<std::string>& names);
  // What killed processes left.
  static void remove_stale_beside(const std::filesystem::path& target);
  // In a target whose lock the caller holds.
  static void remove_stale_in(const std::filesystem::path& target);
};

}  // namespace vggtcd
