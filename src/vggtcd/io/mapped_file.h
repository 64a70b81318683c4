// SPDX-License-Identifier: Apache-2.0
// Files as bytes: copied into memory, or mapped so that the page cache is the only copy.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

namespace vggtcd {

// The bytes of an ordinary file, as many as it has now. Error{kInput} naming the path if it does
// not exist, may not be read, is not an ordinary file, or becomes shorter meanwhile.
std::vector<std::byte> read_file_bytes(const std::filesystem::path& path);

// Mapped read-only for the life of the object, for files of gigabytes. Error{kInput} as above. An
// empty file has no bytes. If the file is shortened, or its disk fails, while it is mapped, what is
// gone reads as zeros, and the next throw_if_interrupted() of the process (core/interrupt.h) throws
// Error{kInput} naming the file: call it before anything that was made from the bytes is kept.
class MappedFile {
 public:
  explicit MappedFile(const std::filesystem::path& path);
  ~MappedFile();
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;

  std::span<const std::byte> bytes() const { return bytes_; }

 private:
  std::span<const std::byte> bytes_;
  size_t guard_ = 0;  // its place among the ranges that the signal handler knows
};

}  // namespace vggtcd
