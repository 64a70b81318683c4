// SPDX-License-Identifier: Apache-2.0
// ResultList: the files that runs of ours wrote into a directory, with size and hash. What is in it
// and unchanged may be replaced or removed; anything else there is somebody's. docs/formats.md.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "vggtcd/io/file_hash.h"

namespace vggtcd {

class ResultList {
 public:
  static constexpr std::string_view kFile = ".vggt-cd-results";

  explicit ResultList(std::string kind) : kind_(std::move(kind)) {}

  // Nothing is listed in a file that is empty, or that version 0.1.0 wrote. Throws Error{kOutput}
  // for a file that is no list, or one that names files outside of the directory.
  static ResultList read(const std::filesystem::path& file);
  static ResultList parse(std::string_view text, const std::string& name);
  std::string text() const;

  // What wrote the files: "results", "scene", ...; empty if nothing is listed.
  const std::string& kind() const { return kind_; }
  bool empty() const { return stamps_.empty(); }
  // Relative to the directory, '/' between parts, in order.
  std::vector<std::string> paths() const;
  bool lists(const std::string& path) const { return stamps_.contains(path); }
  // A regular file (no link), reached through directories (no links), with a size and hash that is
  // listed for it.
  bool owns(const std::filesystem::path& directory, const std::string& path) const;

  // A path may have several stamps: while a file is being replaced it holds the one or the other.
  void add(const std::string& path, const FileStamp& stamp);
  void add(const ResultList& other);
  void remove(const std::string& path) { stamps_.erase(path); }

 private:
  std::string kind_;
  std::map<std::string, std::vector<FileStamp>> stamps_;
};

// Whether all directories on the way to `path` are directories and no links, as far as they exist.
bool reached_through_directories(const std::filesystem::path& directory, const std::string& path);

// The regular files below a directory, relative to it; links are not followed.
std::vector<std::string> files_below(const std::filesystem::path& directory);

}  // namespace vggtcd
