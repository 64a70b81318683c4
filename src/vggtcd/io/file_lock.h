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
  // Locks the file, without waiting. Nothing, with errno, if somebody else holds it (this process
  // included; EWOULDBLOCK) or if it cannot be opened or locked. What is locked is the file that
  // has that name now, not one that was removed or replaced meanwhile.
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
