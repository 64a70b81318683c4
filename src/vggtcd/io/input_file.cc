// SPDX-License-Identifier: Apache-2.0
// InputFile: a stream over an InputDescriptor.
#include "vggtcd/io/input_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <iterator>
#include <new>
#include <system_error>
#include <utility>

#include "vggtcd/core/error.h"
#include "vggtcd/core/interrupt.h"
#include "vggtcd/io/file_system.h"

namespace vggtcd {
namespace {

[[noreturn]] void throw_cannot_read(const std::filesystem::path& path, int error) {
  if (error == ENOMEM) throw std::bad_alloc();
  throw_error(ErrorCode::kInput, "{}: cannot be read: {}", path.string(),
              std::generic_category().message(error));
}

}  // namespace

InputDescriptor::InputDescriptor(const std::filesystem::path& path, std::string_view expected)
    : path_(path) {
  const auto fail = [&](std::string_view found) {
    throw_error(ErrorCode::kInput, "{}: expected {}, found {}", path.string(), expected, found);
  };
  // Not blocking: opening a pipe that nobody writes to would wait for ever.
  number_ = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  if (number_ < 0) {
    if (errno == ENOMEM || errno == EMFILE || errno == ENFILE) throw_cannot_read(path, errno);
    const std::string found = what_stands_at(path);
    fail(found == kAFile ? "a file that may not be read" : found);
  }
  struct stat status = {};
  const bool known = fstat(number_, &status) == 0;
  if (!known || !S_ISREG(status.st_mode)) {
    close(std::exchange(number_, -1));
    fail(what_stands_at(path));
  }
  size_ = static_cast<uint64_t>(status.st_size);
}

InputDescriptor::~InputDescriptor() {
  if (number_ >= 0) close(number_);
}

InputDescriptor::InputDescriptor(InputDescriptor&& other) noexcept
    : path_(std::move(other.path_)),
      number_(std::exchange(other.number_, -1)),
      size_(other.size_) {}

size_t InputDescriptor::read(std::span<char> bytes) const {
  while (true) {
    throw_if_interrupted();
    const ssize_t count = ::read(number_, bytes.data(), bytes.size());
    if (count >= 0) return static_cast<size_t>(count);
    if (errno != EINTR) throw_cannot_read(path_, errno);
  }
}

InputFile::InputFile(const std::filesystem::path& path, std::string_view expected)
    : std::istream(nullptr), buffer_(InputDescriptor(path, expected)) {
  rdbuf(&buffer_);
  exceptions(std::ios::badbit);  // hands on what the buffer throws
}

std::string InputFile::read_all() { return {std::istreambuf_iterator<char>(&buffer_), {}}; }

InputFile::Buffer::int_type InputFile::Buffer::underflow() {
  constexpr size_t kBytes = 1 << 16;
  bytes.resize(kBytes);
  const size_t count = descriptor.read(bytes);
  setg(bytes.data(), bytes.data(), bytes.data() + count);
  return count == 0 ? traits_type::eof() : traits_type::to_int_type(bytes.front());
}

InputFile::Buffer::pos_type InputFile::Buffer::seekoff(off_type offset, std::ios_base::seekdir from,
                                                       std::ios_base::openmode) {
  const bool relative = from == std::ios_base::cur;
  const off_type ahead = egptr() - gptr();  // read, but not yet taken
  if (relative && offset == 0) return pos_type(lseek(descriptor.number(), 0, SEEK_CUR) - ahead);
  const int whence = relative ? SEEK_CUR : from == std::ios_base::beg ? SEEK_SET : SEEK_END;
  setg(nullptr, nullptr, nullptr);
  return pos_type(lseek(descriptor.number(), relative ? offset - ahead : offset, whence));
}

InputFile::Buffer::pos_type InputFile::Buffer::seekpos(pos_type position,
                                                       std::ios_base::openmode which) {
  return seekoff(off_type(position), std::ios_base::beg, which);
}

}  // namespace vggtcd
