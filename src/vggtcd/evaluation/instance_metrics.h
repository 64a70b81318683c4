// SPDX-License-Identifier: Apache-2.0
// How well reported changed things agree with the true ones, by the pixels both cover.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace vggtcd {

// One epoch, all [S, H, W]. Labels as in synthetic/render.h.
struct InstancePixels {
  std::span<const int32_t> reported;      // id of the reported instance; 0: none
  std::span<const uint16_t> object;       // id of the true object; 0: sky
  std::span<const uint8_t> label;         // unchanged, changed, void
  std::span<const uint8_t> other_looked;  // 0: the other epoch never saw the place
};

// What is counted is appearances: an object that moved appears in T1 and in T2, and both places
// are to be found. An appearance is expected to be found if the object is larger than kMinSize and
// the pixels that show it as changed, at a place that the other epoch looked at, are at least
// kMinVisible of the epoch's.
//
// An appearance is found if one reported instance covers kMinCovered of those pixels, and kMinRight
// of that instance's pixels lie on changed surface of whatever object. It is told apart if,
// besides, kMinRight of the instance's pixels on changed surface lie on this object. A reported
// instance (its part in one epoch) is right if kMinRight of its pixels lie on changed surface. Void
// pixels are left out everywhere, but for the sky, which is unchanged; what the other epoch never
// saw counts as what it is.
//
// Why not IoU above one half: a method that drops the less confident half of the pixels, as the
// paper's does, covers half of an object when it finds all that it looks at, and things that touch
// (a table and what stands on it) are one region to any method without semantics.
struct InstanceMatchRule {
  static constexpr double kMinSize = 0.02;       // longest edge of the box / scene extent
  static constexpr double kMinVisible = 0.0002;  // share of the epoch's pixels
  static constexpr double kMinCovered = 0.25;
  static constexpr double kMinRight = 0.5;
};

struct InstanceScores {
  int objects = 0;      // appearances to be found
  int found = 0;        // of them
  int told_apart = 0;   // of the found ones
  int small = 0;        // appearances left out for their size
  int hardly_seen = 0;  // or because too few pixels show them
  int reported = 0;     // parts of reported instances
  int right = 0;        // of them

  double recall() const { return objects > 0 ? static_cast<double>(found) / objects : 0; }
  double precision() const { return reported > 0 ? static_cast<double>(right) / reported : 0; }
  InstanceScores& operator+=(const InstanceScores& other);
};

// `object_size` by object id (index 0 unused): longest edge of its box / scene extent.
InstanceScores evaluate_instances(std::span<const InstancePixels> epochs,
                                  std::span<const double> object_size);

}  // namespace vggtcd
