// SPDX-License-Identifier: Apache-2.0
// MappedFile: a file as bytes without reading it: the page cache is the only copy.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

namespace vggtcd {

// Mapped read-only for the life of the object. Error{kInput} naming the path if it does not exist,
// may not be read or is not an ordinary file. An empty file has no bytes. The file must not be
// shortened while it is mapped: the kernel would end the process (SIGBUS).
class MappedFile {
 public:
  explicit MappedFile(const std::filesystem::path& path);
  ~MappedFile();
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;

  std::span<const std::byte> bytes() const { return bytes_; }

 private:
  std::span<const std::byte> bytes_;
};

}  // namespace vggtcd
