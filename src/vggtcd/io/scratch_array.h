// SPDX-License-Identifier: Apache-2.0
// ScratchArray: an array on disk instead of in memory, gone when the object is, whatever happens.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

namespace vggtcd {

// A file without a name in `directory`, which must be there. Positions are bytes; disjoint parts
// may be written and read by several threads at a time. Reading what was never written is a defect
// of the caller. Throws Error{kOutput} naming the directory: no permission, disk full.
class ScratchFile {
 public:
  explicit ScratchFile(std::filesystem::path directory);
  ~ScratchFile();
  ScratchFile(ScratchFile&& other) noexcept;
  ScratchFile& operator=(ScratchFile&&) = delete;

  void write(uint64_t position, std::span<const std::byte> bytes);
  void read(uint64_t position, std::span<std::byte> bytes) const;

 private:
  std::filesystem::path directory_;
  int file_ = -1;
};

// The same in elements.
template <typename T>
class ScratchArray {
 public:
  explicit ScratchArray(std::filesystem::path directory) : file_(std::move(directory)) {}
  void write(size_t first, std::span<const T> values) {
    file_.write(first * sizeof(T), std::as_bytes(values));
  }
  void read(size_t first, std::span<T> values) const {
    file_.read(first * sizeof(T), std::as_writable_bytes(values));
  }

 private:
  ScratchFile file_;
};

}  // namespace vggtcd
