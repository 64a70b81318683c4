// SPDX-License-Identifier: Apache-2.0
// file_bytes: open, fstat, read in pieces.
#include "vggtcd/io/file_bytes.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "vggtcd/core/error.h"
#include "vggtcd/core/interrupt.h"

namespace vggtcd {
namespace {

struct Descriptor {
  int fd;
  ~Descriptor() {
    if (fd >= 0) close(fd);
  }
};

}  // namespace

std::string read_file_bytes(const std::filesystem::path& path) {
  const auto fail = [&](std::string_view why) {
    throw_error(ErrorCode::kInput, "{}: expected a readable file, found {}", path.string(), why);
  };
  // Not blocking: opening a pipe nobody writes to would wait for ever.
  const Descriptor file{open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)};
  if (file.fd < 0) fail(errno == ENOENT ? "no such file" : std::strerror(errno));
  struct stat status = {};
  if (fstat(file.fd, &status) != 0) fail(std::strerror(errno));
  if (S_ISDIR(status.st_mode)) fail("a directory");
  if (!S_ISREG(status.st_mode)) fail("something that is no ordinary file");
  constexpr size_t kPiece = size_t{16} << 20;
  std::string bytes;
  bytes.reserve(static_cast<size_t>(status.st_size));
  while (true) {
    throw_if_interrupted();
    const size_t size = bytes.size();
    const size_t left = static_cast<size_t>(status.st_size) -
                        std::min<size_t>(size, static_cast<size_t>(status.st_size));
    bytes.resize(size + std::clamp(left, size_t{1}, kPiece));
    const ssize_t count = read(file.fd, bytes.data() + size, bytes.size() - size);
    if (count < 0 && errno != EINTR) fail(std::strerror(errno));
    bytes.resize(size + static_cast<size_t>(std::max<ssize_t>(count, 0)));
    if (count == 0) return bytes;
  }
}

}  // namespace vggtcd
