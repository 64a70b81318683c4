// SPDX-License-Identifier: Apache-2.0
// OutputFile: a file written aside and renamed when complete, so that its path never holds half of
// it.
#pragma once

#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <span>
#include <string_view>

namespace vggtcd {

// The file that is meant by `path`: a link stays, what it leads to is replaced, there or not.
// Throws Error{kOutput} for a directory, a device or a pipe.
std::filesystem::path output_file_target(const std::filesystem::path& path);

// Every failure (no such directory, no permission, disk full) throws Error{kOutput} naming the
// path.
class OutputFile {
 public:
  explicit OutputFile(std::filesystem::path path);  // replaces a file of that name on commit()
  ~OutputFile();                                    // without commit(): leaves nothing behind
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(std::string_view text);
  void write(std::span<const std::byte> bytes);
  void commit();

 private:
  std::filesystem::path path_;    // as it was given, for messages
  std::filesystem::path target_;  // without links
  std::filesystem::path aside_;   // beside it, under a name of its own
  std::FILE* file_ = nullptr;
};

// Writes all of it and commits.
void write_text_file(const std::filesystem::path& path, std::string_view text);

}  // namespace vggtcd
