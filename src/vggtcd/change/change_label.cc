// SPDX-License-Identifier: Apache-2.0
// The answers about a pixel, by name.
#include "vggtcd/change/change_label.h"

namespace vggtcd {

std::span<const EnumName<ChangeLabel>> enum_names(ChangeLabel) {
  static constexpr EnumName<ChangeLabel> kNames[] = {{ChangeLabel::kUnchanged, "unchanged"},
                                                     {ChangeLabel::kRemoved, "removed"},
                                                     {ChangeLabel::kAdded, "added"},
                                                     {ChangeLabel::kUnobserved, "unobserved"},
                                                     {ChangeLabel::kNoEvidence, "no_evidence"}};
  return kNames;
}

}  // namespace vggtcd
