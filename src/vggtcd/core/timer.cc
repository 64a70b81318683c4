// SPDX-License-Identifier: Apache-2.0
// Wall-clock time from std::chrono, memory from /proc and the control group.
#include "vggtcd/core/timer.h"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <limits>
#include <string>

namespace vggtcd {
namespace {

// A "Key:  123 kB" line of a /proc file, in bytes; -1 if absent.
int64_t proc_kib_field(const char* path, const std::string& key) {
  std::ifstream file(path);
  std::string word;
  while (file >> word) {
    if (word == key) {
      int64_t kib = 0;
      return file >> kib ? kib * 1024 : -1;
    }
    file.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  }
  return -1;
}

int64_t read_number(const char* path) {
  std::ifstream file(path);
  int64_t value = 0;
  return file >> value ? value : -1;
}

}  // namespace

double monotonic_seconds() {
  using std::chrono::duration;
  return duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

int64_t peak_memory_bytes() {
  return std::max<int64_t>(0, proc_kib_field("/proc/self/status", "VmHWM:"));
}

int64_t resident_memory_bytes() {
  return std::max<int64_t>(0, proc_kib_field("/proc/self/status", "VmRSS:"));
}

int64_t available_memory_bytes() {
  int64_t available = proc_kib_field("/proc/meminfo", "MemAvailable:");
  if (available < 0) available = std::numeric_limits<int64_t>::max();
  const int64_t limit = read_number("/sys/fs/cgroup/memory.max");
  const int64_t used = read_number("/sys/fs/cgroup/memory.current");
  if (limit > 0 && used >= 0) available = std::min(available, std::max<int64_t>(0, limit - used));
  return available;
}

}  // namespace vggtcd
