// SPDX-License-Identifier: Apache-2.0
// FileLock: who works on something. A lock ends with the process that holds it, however it ends.
#pragma once

#include <filesystem>
#include <optional>
#include <utility>

namespace vggtcd {

class FileLock {
 public:
  enum class IfMissing { kCreate, kGiveUp };
  // Locks the file, without waiting. Nothing if somebody else holds it (this process included) or
  // if it cannot be opened.
  static std::optional<FileLock> try_lock(const std::filesystem::path& path,
                                          IfMissing missing = IfMissing::kCreate);
  ~FileLock();
  FileLock(FileLock&& other) noexcept : file_(std::exchange(other.file_, -1)) {}
  FileLock& operator=(FileLock&& other) noexcept {
    std::swap(file_, other.file_);
    return *this;
  }

 private:
  explicit FileLock(int file) : file_(file) {}
  int file_;
};

}  // namespace vggtcd
