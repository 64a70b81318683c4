// SPDX-License-Identifier: Apache-2.0
// Files as bytes: open, fstat, then read or mmap; and what happens when a mapped file is cut off.
#include "vggtcd/io/mapped_file.h"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <mutex>
#include <new>
#include <set>

#include "vggtcd/core/error.h"
#include "vggtcd/core/interrupt.h"
#include "vggtcd/io/file_system.h"
#include "vggtcd/io/input_descriptor.h"

namespace vggtcd {
namespace {

// What the signal handler may look at: mapped ranges and the sentence for each.
struct Range {
  std::atomic<uintptr_t> begin{0}, end{0};
  std::atomic<const char*> what{nullptr};
};
constexpr size_t kMaxRanges = 4096;
std::array<Range, kMaxRanges> g_ranges;
struct sigaction g_before = {};

// Beyond the end of a file that was shortened there is no page to read: the kernel sends SIGBUS.
// Zeros take the place of all that follows, and the job stops at its next look.
void on_bus_error(int signal, siginfo_t* info, void* context) {
  const auto address = reinterpret_cast<uintptr_t>(info->si_addr);
  for (Range& range : g_ranges) {
    const uintptr_t begin = range.begin.load(), end = range.end.load();
    if (begin == 0 || address < begin || address >= end) continue;
    const uintptr_t page = address - (address - begin) % static_cast<uintptr_t>(getpagesize());
    void* const zeros = mmap(reinterpret_cast<void*>(page), end - page, PROT_READ,
                             MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED, -1, 0);
    if (zeros == MAP_FAILED) break;
    request_stop_input_lost(range.what.load());
    return;
  }
  // Not ours: whoever was here before, or the default, which ends the process.
  if ((g_before.sa_flags & SA_SIGINFO) != 0 && g_before.sa_sigaction != nullptr) {
    g_before.sa_sigaction(signal, info, context);
  } else {
    sigaction(signal, &g_before, nullptr);
  }
}

// Sentences live as long as the process: the handler may need one of a file that is closed by now.
const char* sentence_for(const std::filesystem::path& path) {
  static std::set<std::string> kept;
  return kept
      .insert(fmt::format("{}: was cut off, or its disk failed, while it was in use; put the whole "
                          "file in its place and start again",
                          path.string()))
      .first->c_str();
}

size_t guard(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  [[maybe_unused]] static const bool installed = [] {
    struct sigaction action = {};
    action.sa_sigaction = on_bus_error;
    action.sa_flags = SA_SIGINFO;
    sigemptyset(&action.sa_mask);
    sigaction(SIGBUS, &action, &g_before);
    return true;
  }();
  const auto place =
      std::find_if(g_ranges.begin(), g_ranges.end(), [](const Range& r) { return r.begin == 0; });
  if (place == g_ranges.end()) {
    throw_error(ErrorCode::kInput, "{}: cannot be read: too many files are open", path.string());
  }
  const auto begin = reinterpret_cast<uintptr_t>(bytes.data());
  place->what = sentence_for(path);
  place->end = begin + bytes.size();
  place->begin = begin;
  return static_cast<size_t>(place - g_ranges.begin());
}

}  // namespace

std::vector<std::byte> read_file_bytes(const std::filesystem::path& path) {
  const InputDescriptor file(path, kAFile);
  std::vector<std::byte> bytes(file.size());
  for (size_t at = 0; at < bytes.size();) {
    const size_t piece = std::min(bytes.size() - at, size_t{16} << 20);
    const size_t count = file.read({reinterpret_cast<char*>(bytes.data()) + at, piece});
    if (count == 0) {
      throw_error(ErrorCode::kInput,
                  "{}: cannot be read: it became shorter meanwhile; wait until it is complete",
                  path.string());
    }
    at += count;
  }
  return bytes;
}

MappedFile::MappedFile(const std::filesystem::path& path) {
  const InputDescriptor file(path, kAFile);
  if (file.size() == 0) return;
  void* memory = mmap(nullptr, file.size(), PROT_READ, MAP_PRIVATE, file.number(), 0);
  if (memory == MAP_FAILED && errno == ENOMEM) throw std::bad_alloc();
  if (memory == MAP_FAILED) {
    throw_error(ErrorCode::kInput, "{}: cannot be read: {}", path.string(), std::strerror(errno));
  }
  const std::span<const std::byte> bytes(static_cast<const std::byte*>(memory), file.size());
  try {
    guard_ = guard(path, bytes);
  } catch (...) {
    munmap(memory, file.size());
    throw;
  }
  bytes_ = bytes;
}

MappedFile::~MappedFile() {
  if (bytes_.empty()) return;
  g_ranges[guard_].begin = 0;
  munmap(const_cast<std::byte*>(bytes_.data()), bytes_.size());
}

}  // namespace vggtcd
