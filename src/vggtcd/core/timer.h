// SPDX-License-Identifier: Apache-2.0
// Wall-clock time and peak memory of this process.
#pragma once

#include <cstdint>

namespace vggtcd {

// Seconds of a monotonic clock with an arbitrary origin.
double monotonic_seconds();

class Timer {
 public:
  Timer() : started_s_(monotonic_seconds()) {}
  double seconds() const { return monotonic_seconds() - started_s_; }

 private:
  double started_s_;
};

// Largest resident set of this process so far, in bytes (VmHWM).
int64_t peak_memory_bytes();

// Resident set of this process now, in bytes (VmRSS).
int64_t resident_memory_bytes();

// Memory that could be had without swapping, in bytes: the smaller of the kernel's MemAvailable and
// what is left under the control group's limit.
int64_t available_memory_bytes();

}  // namespace vggtcd
