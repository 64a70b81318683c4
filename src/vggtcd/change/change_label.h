// SPDX-License-Identifier: Apache-2.0
// The answers about a pixel.
#pragma once

#include <cstdint>
#include <span>

#include "vggtcd/core/options.h"

namespace vggtcd {

// In T1's photos a changed pixel is `removed` (it was there, and is gone), in T2's `added`. The
// numbers are those of the files (docs/formats.md).
enum class ChangeLabel : uint8_t {
  kUnchanged = 0,
  kRemoved = 1,
  kAdded = 2,
  kUnobserved = 3,   // no photo of the other epoch could have seen it
  kNoEvidence = 255  // no depth here, or a confidence too low to say anything
};
std::span<const EnumName<ChangeLabel>> enum_names(ChangeLabel);

constexpr bool is_change(ChangeLabel label) {
  return label == ChangeLabel::kRemoved || label == ChangeLabel::kAdded;
}

}  // namespace vggtcd
