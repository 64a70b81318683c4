// SPDX-License-Identifier: Apache-2.0
// OutputFile: stdio with every return value looked at.
#include "vggtcd/io/output_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <new>

#include "vggtcd/core/error.h"
#include "vggtcd/io/output_path.h"

namespace vggtcd {
namespace {

[[noreturn]] void throw_cannot_write(const std::filesystem::path& path, int error) {
  if (error == ENOMEM) throw std::bad_alloc();
  throw_error(ErrorCode::kOutput, "{}: cannot be written: {}", path.string(), std::strerror(error));
}

}  // namespace

std::filesystem::path output_file_target(const std::filesystem::path& path) {
  std::filesystem::path target = resolve_output(path);
  struct stat status = {};
  if (stat(target.c_str(), &status) != 0 || S_ISREG(status.st_mode)) return target;
  if (S_ISDIR(status.st_mode)) throw_cannot_write(path, EISDIR);
  throw_error(ErrorCode::kOutput, "{}: expected a file to replace, found a device or a pipe",
              path.string());
}

OutputFile::OutputFile(std::filesystem::path path) : path_(std::move(path)) {
  if (path_.empty()) throw_cannot_write(path_, ENOENT);
  target_ = output_file_target(path_);
  aside_ = make_unique(target_.parent_path() / partial_prefix(target_.filename().string()),
                       [&](const std::filesystem::path& aside) {
                         const int file =
                             open(aside.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
                         if (file >= 0) file_ = fdopen(file, "wb");
                         return file >= 0;
                       });
  if (file_ == nullptr) throw_cannot_write(path_, errno);
}

OutputFile::~OutputFile() {
  if (file_ == nullptr) return;
  std::fclose(file_);
  unlink(aside_.c_str());
}

void OutputFile::write(std::string_view text) { write(std::as_bytes(std::span(text))); }

void OutputFile::write(std::span<const std::byte> bytes) {
  check(file_ != nullptr, "OutputFile: write after commit");
  if (bytes.empty()) return;
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_) != bytes.size()) {
    throw_cannot_write(path_, errno);
  }
}

void OutputFile::commit() {
  check(file_ != nullptr, "OutputFile: committed twice");
  // A full disk may show only when the last buffer is flushed.
  const bool flushed = std::fflush(file_) == 0;
  const int flush_error = errno;
  const bool closed = std::fclose(file_) == 0;
  const int close_error = errno;
  file_ = nullptr;
  if (flushed && closed && std::rename(aside_.c_str(), target_.c_str()) == 0) return;
  const int error = !flushed ? flush_error : !closed ? close_error : errno;
  unlink(aside_.c_str());
  throw_cannot_write(path_, error);
}

void write_text_file(const std::filesystem::path& path, std::string_view text) {
  OutputFile file(path);
  file.write(text);
  file.commit();
}

}  // namespace vggtcd
