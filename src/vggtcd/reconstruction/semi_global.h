// SPDX-License-Identifier: Apache-2.0
// Semi-global aggregation of matching costs along eight directions (Hirschmueller 2008).
#pragma once

#include <cstdint>
#include <vector>

namespace vggtcd {

struct SemiGlobalOptions {
  int small_step = 6;       // P1: cost of a change of one plane, in units of the matching cost
  int large_step = 60;      // P2: cost of a larger change, where brightness does not change
  int large_step_min = 20;  // P2 is divided by the brightness step / 8, down to this
};

// costs: [H, W, planes] of at most 127. Returns sums over eight paths, [H, W, planes]; gray is the
// brightness of the image, whose edges are where depth may jump.
std::vector<uint16_t> aggregate_semi_global(const std::vector<uint8_t>& costs, int width,
                                            int height, int planes, const std::vector<float>& gray,
                                            const SemiGlobalOptions& options);

}  // namespace vggtcd
