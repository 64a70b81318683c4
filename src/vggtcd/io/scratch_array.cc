// SPDX-License-Identifier: Apache-2.0
// ScratchArray: an array on disk instead of in memory.
#include "vggtcd/io/scratch_array.h"

#include <stdlib.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

[[noreturn]] void throw_failed(const std::filesystem::path& directory, const char* what) {
  throw_error(ErrorCode::kOutput, "{}: temporary data cannot be {}: {}", directory.string(), what,
              std::strerror(errno));
}

}  // namespace

ScratchFile::ScratchFile(std::filesystem::path directory) : directory_(std::move(directory)) {
  std::string name = (directory_ / ".scratch-XXXXXX").string();
  file_ = mkstemp(name.data());
  if (file_ < 0) throw_failed(directory_, "written");
  unlink(name.c_str());  // it lives as long as it is open
}

ScratchFile::~ScratchFile() {
  if (file_ >= 0) close(file_);
}

ScratchFile::ScratchFile(ScratchFile&& other) noexcept
    : directory_(std::move(other.directory_)), file_(std::exchange(other.file_, -1)) {}

void ScratchFile::write(uint64_t position, std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t count = pwrite(file_, bytes.data(), bytes.size(), static_cast<off_t>(position));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throw_failed(directory_, "written");
    position += static_cast<uint64_t>(count);
    bytes = bytes.subspan(static_cast<size_t>(count));
  }
}

void ScratchFile::read(uint64_t position, std::span<std::byte> bytes) const {
  while (!bytes.empty()) {
    const ssize_t count = pread(file_, bytes.data(), bytes.size(), static_cast<off_t>(position));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throw_failed(directory_, "read");
    check(count > 0, "ScratchFile: read what was written");
    position += static_cast<uint64_t>(count);
    bytes = bytes.subspan(static_cast<size_t>(count));
  }
}

}  // namespace vggtcd
