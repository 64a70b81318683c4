// SPDX-License-Identifier: Apache-2.0
// Random: a small generator whose numbers depend on the seed alone, not on the standard library
// (std::normal_distribution differs between implementations). SplitMix64 of Steele et al. 2014.
#pragma once

#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <numbers>

namespace vggtcd {

// One step of SplitMix64: a bijection of 64 bits that leaves no visible pattern.
constexpr uint64_t mix64(uint64_t x) {
  x += 0x9E3779B97F4A7C15ull;
  x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ull;
  x = (x ^ (x >> 27)) * 0x94D049BB133111EBull;
  return x ^ (x >> 31);
}

constexpr uint64_t mix64(uint64_t a, uint64_t b) { return mix64(a ^ mix64(b)); }

class Random {
 public:
  explicit Random(uint64_t seed) : state_(seed) {}
  // A stream of its own for every list of keys, e.g. {pass, frame}.
  Random(uint64_t seed, std::initializer_list<uint64_t> keys) : state_(seed) {
    for (const uint64_t key : keys) state_ = mix64(state_, key);
  }

  uint64_t next() { return mix64(state_++ * 0xD1342543DE82EF95ull); }
  double uniform() { return static_cast<double>(next() >> 11) * 0x1.0p-53; }  // [0, 1)
  double uniform(double low, double high) { return low + (high - low) * uniform(); }
  int below(int count) {  // 0 .. count-1
    return static_cast<int>(next() % static_cast<uint64_t>(count));
  }
  double normal() {  // Box and Muller
    const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
    return radius * std::cos(2.0 * std::numbers::pi * uniform());
  }

 private:
  uint64_t state_;
};

}  // namespace vggtcd
