// SPDX-License-Identifier: Apache-2.0
// SplitMix64: one step of the generator of Steele, Lea and Flood, "Fast splittable pseudorandom
// number generators" (OOPSLA 2014). A bijection of 64 bits that leaves no visible pattern, so it
// serves as a hash as well.
#pragma once

#include <cstdint>

namespace vggtcd {

constexpr uint64_t kSplitMix64Step = 0x9E3779B97F4A7C15u;

// The generator with state x gives this number and goes on with state x + kSplitMix64Step.
constexpr uint64_t splitmix64(uint64_t x) {
  x += kSplitMix64Step;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9u;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBu;
  return x ^ (x >> 31);
}

// A number in [0, 1), a multiple of 2^-53, of the upper bits.
constexpr double unit_interval(uint64_t bits) { return static_cast<double>(bits >> 11) * 0x1p-53; }

}  // namespace vggtcd
