// SPDX-License-Identifier: Apache-2.0
// FileLock: flock(2), which the kernel releases when the last descriptor is closed.
#include "vggtcd/io/file_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>

namespace vggtcd {

std::optional<FileLock> FileLock::try_lock(const std::filesystem::path& path, IfMissing missing) {
  const int create = missing == IfMissing::kCreate ? O_CREAT : 0;
  for (;;) {
    // Closed on exec: a program that we start does not hold our locks. A link or a pipe is nobody's
    // lock, and must not be waited for.
    const int flags = O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK | create;
    const int file = open(path.c_str(), flags, 0666);
    if (file < 0) return std::nullopt;
    FileLock lock(file);
    if (flock(file, LOCK_EX | LOCK_NB) != 0) return std::nullopt;
    struct stat locked = {}, named = {};
    if (fstat(file, &locked) != 0) return std::nullopt;
    const bool there = lstat(path.c_str(), &named) == 0;
    if (there && locked.st_dev == named.st_dev && locked.st_ino == named.st_ino) return lock;
    if (!there && missing == IfMissing::kGiveUp) return std::nullopt;
  }
}

FileLock::~FileLock() {
  const int before = errno;  // of what failed while the lock was held
  if (file_ >= 0) close(file_);
  errno = before;
}

}  // namespace vggtcd
