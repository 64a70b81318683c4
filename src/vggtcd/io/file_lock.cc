// SPDX-License-Identifier: Apache-2.0
// FileLock: flock(2), which the kernel releases when the last descriptor is closed.
#include "vggtcd/io/file_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

namespace vggtcd {

std::optional<FileLock> FileLock::try_lock(const std::filesystem::path& path, IfMissing missing) {
  const int create = missing == IfMissing::kCreate ? O_CREAT : 0;
  // Closed on exec: a program that we start does not hold our locks.
  const int file = open(path.c_str(), O_RDWR | O_CLOEXEC | create, 0644);
  if (file < 0) return std::nullopt;
  FileLock lock(file);
  if (flock(file, LOCK_EX | LOCK_NB) != 0) return std::nullopt;
  return lock;
}

FileLock::~FileLock() {
  if (file_ >= 0) close(file_);
}

}  // namespace vggtcd
