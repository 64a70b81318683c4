// SPDX-License-Identifier: Apache-2.0
// OutputDirectory: a directory of results that appears complete or not at all.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "vggtcd/io/file_lock.h"

namespace vggtcd {

// Files are written into a directory beside the target, "OUT.partial-PID", and commit() puts it in
// the target's place. A target that is there already must be empty or an earlier directory of
// results, which is then replaced as a whole; results are recognised by the file kMarker. Every
// failure throws Error{kOutput} in one line, and leaves the target as it was and nothing beside it.
// What a killed process left beside the target, the next OutputDirectory of that target removes:
// the marker is locked while somebody writes.
class OutputDirectory {
 public:
  static constexpr std::string_view kMarker = ".vggt-cd-results";

  // Fails now, before any work is done, if the results could not be written later. commit() moves
  // the entries `kept` of an earlier target into the new one instead of removing them.
  explicit OutputDirectory(const std::filesystem::path& target, std::vector<std::string> kept = {});
  ~OutputDirectory();  // without commit(): removes what was written
  OutputDirectory(const OutputDirectory&) = delete;
  OutputDirectory& operator=(const OutputDirectory&) = delete;

  // Where to write for now.
  const std::filesystem::path& path() const { return aside_; }
  std::filesystem::path operator/(std::string_view name) const { return aside_ / name; }
  // path() / name, created.
  std::filesystem::path subdirectory(std::string_view name) const;

  void commit();

 private:
  std::filesystem::path target_;
  std::filesystem::path aside_;
  std::filesystem::path first_created_parent_;  // empty if all parents were there
  std::vector<std::string> kept_;
  std::optional<FileLock> lock_;  // on the marker in aside_
  bool committed_ = false;
};

}  // namespace vggtcd
