// SPDX-License-Identifier: Apache-2.0
// What the program says about its own alignments, beside the truth.
#pragma once

#include <string>
#include <vector>

#include "vggtcd/evaluation/benchmark.h"

namespace vggtcd {

// A section of the report: of every scene the verdict of the robust method, its ATE against the
// floor and the coarse one, and the share of unchanged pixels that are called changed; above it how
// many are called believable although the ATE is above twice the floor, or although more than a
// tenth of the unchanged pixels are called changed. Empty where no floor is known.
std::string verdict_section(const std::vector<SceneOutcome>& scenes);

}  // namespace vggtcd
