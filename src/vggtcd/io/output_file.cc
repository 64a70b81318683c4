// SPDX-License-Identifier: Apache-2.0
// OutputFile: stdio with every return value looked at.
#include "vggtcd/io/output_file.h"

#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <new>

#include "vggtcd/core/error.h"
#include "vggtcd/io/file_system.h"

namespace vggtcd {
namespace {

[[noreturn]] void throw_cannot_write(const std::filesystem::path& path, int error) {
  if (error == ENOMEM) throw std::bad_alloc();
  throw_error(ErrorCode::kOutput, "{}: cannot be written: {}", path.string(), std::strerror(error));
}

// A long name is cut, because the suffix must fit into a name too; its hash tells it from others.
std::string aside_name(const std::string& name) {
  constexpr size_t kMaxBytes = 220;
  if (name.size() <= kMaxBytes) return fmt::format("{}.partial-{}", name, getpid());
  return fmt::format("{}.{:x}.partial-{}", name.substr(0, 180), std::hash<std::string>{}(name),
                     getpid());
}

}  // namespace

OutputFile::OutputFile(std::filesystem::path path) : path_(std::move(path)) {
  // A link stays, its target is replaced; a device or a pipe would be.
  if (is_link(path_) && exists_at(path_)) path_ = without_links(path_);
  if (is_folder(path_)) throw_cannot_write(path_, EISDIR);
  if (exists_at(path_) && !is_file(path_)) {
    throw_error(ErrorCode::kOutput, "{}: expected a file to replace, found a device or a pipe",
                path_.string());
  }
  // The process id keeps two programs writing the same file from mixing their bytes.
  aside_ = path_.parent_path() / aside_name(path_.filename().string());
  file_ = std::fopen(aside_.c_str(), "wb");
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
  if (flushed && closed && std::rename(aside_.c_str(), path_.c_str()) == 0) return;
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
