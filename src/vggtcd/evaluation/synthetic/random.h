// SPDX-License-Identifier: Apache-2.0
// Random: a small generator whose numbers depend on the seed alone, not on the standard library
// (std::normal_distribution differs between implementations).
#pragma once

#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <numbers>

#include "vggtcd/core/splitmix64.h"

namespace vggtcd {

constexpr uint64_t mix64(uint64_t a, uint64_t b) { return splitmix64(a ^ splitmix64(b)); }

class Random {
 public:
  explicit Random(uint64_t seed) : state_(seed) {}
  // A stream of its own for every list of keys, e.g. {pass, frame}.
  Random(uint64_t seed, std::initializer_list<uint64_t> keys) : state_(seed) {
    for (const uint64_t key : keys) state_ = mix64(state_, key);
  }

  uint64_t next() { return splitmix64(state_++ * 0xD1342543DE82EF95ull); }
  double uniform() { return unit_interval(next()); }
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
