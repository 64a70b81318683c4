// SPDX-License-Identifier: Apache-2.0
// ImageBatch: what the network reads: photos of one size, colours in [0, 1], not yet normalised.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace vggtcd {

struct ImageBatch {
  int64_t frames = 0, height = 0, width = 0;  // height and width are multiples of 14
  std::vector<float> pixels;                  // [S, 3, H, W] RGB in [0, 1]
  std::vector<std::string> names;             // one per frame, or empty
};

}  // namespace vggtcd
