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
  std::filesystem::path path_;
  std::filesystem::path aside_;
  std::FILE* file_ = nullptr;
};

// Writes all of it and commits.
void write_text_file(const std::filesystem::path& path, std::string_view text);

}  // namespace vggtcd
