// SPDX-License-Identifier: Apache-2.0
// ForeignLines: stderr and std::cerr lead to the capture of the thread that prints.
#include "vggtcd/io/foreign_lines.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <iostream>
#include <sstream>
#include <streambuf>
#include <string_view>

namespace vggtcd {
namespace {

constexpr size_t kMaxKept = 16384;  // a damaged picture may be complained about without end

thread_local std::string* t_kept = nullptr;

#ifdef __GLIBC__
ssize_t route(void*, const char* bytes, size_t size) {
  if (t_kept != nullptr) {
    t_kept->append(bytes, std::min(size, kMaxKept - std::min(kMaxKept, t_kept->size())));
    return static_cast<ssize_t>(size);
  }
  for (size_t at = 0; at < size;) {
    const ssize_t count = write(STDERR_FILENO, bytes + at, size - at);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return static_cast<ssize_t>(at);  // fewer than asked: the stream's error
    at += static_cast<size_t>(count);
  }
  return static_cast<ssize_t>(size);
}

class RoutedBuffer : public std::streambuf {
 protected:
  std::streamsize xsputn(const char* bytes, std::streamsize size) override {
    return static_cast<std::streamsize>(std::fwrite(bytes, 1, static_cast<size_t>(size), stderr));
  }
  int overflow(int byte) override { return byte == EOF ? 0 : std::fputc(byte, stderr); }
};

// For the rest of the process: the streams may be in use by other threads at any time.
void install() {
  [[maybe_unused]] static const bool installed = [] {
    std::FILE* routed = fopencookie(
        nullptr, "w", {.read = nullptr, .write = route, .seek = nullptr, .close = nullptr});
    if (routed == nullptr) return false;
    std::setvbuf(routed, nullptr, _IONBF, 0);
    stderr = routed;
    static RoutedBuffer buffer;
    std::cerr.rdbuf(&buffer);
    return true;
  }();
}
#else
void install() {}
#endif

// "[ WARN:0@0.013] global loadsave.cpp:304 validate: text" -> "text" as far as it has that form.
std::string_view without_prefix(std::string_view line) {
  const size_t end = line.substr(0, 1) == "[" ? line.find("] ") : std::string_view::npos;
  if (end != std::string_view::npos) line.remove_prefix(end + 2);
  while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.remove_suffix(1);
  return line;
}

}  // namespace

ForeignLines::ForeignLines() : outer_(t_kept) {
  install();
  t_kept = &text_;
}

ForeignLines::~ForeignLines() { t_kept = outer_; }

std::vector<std::string> ForeignLines::lines() const {
  std::vector<std::string> result;
  std::istringstream stream(text_);
  for (std::string whole; std::getline(stream, whole);) {
    const std::string_view line = without_prefix(whole);
    if (line.empty() || std::ranges::find(result, line) != result.end()) continue;
    result.emplace_back(line);
  }
  return result;
}

}  // namespace vggtcd
