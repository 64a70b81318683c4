// SPDX-License-Identifier: Apache-2.0
// Keyframe selection by farthest point sampling in index space (Eq. 2 of the paper).
#include "vggtcd/scene/keyframes.h"

#include <algorithm>
#include <cstdlib>

#include "vggtcd/core/options.h"

namespace vggtcd {

std::vector<int> select_keyframes(int num_frames, int count) {
  check_field(num_frames >= 1, "frames", num_frames, "at least 1");
  check_field(count >= 1, "keyframes", count, "at least 1");
  std::vector<int> chosen = {0};
  // distance[i]: to the nearest chosen frame; a chosen frame has 0 and never wins again.
  std::vector<int> distance(static_cast<size_t>(num_frames));
  for (int i = 0; i < num_frames; ++i) distance[static_cast<size_t>(i)] = i;
  while (static_cast<int>(chosen.size()) < std::min(count, num_frames)) {
    const int next =
        static_cast<int>(std::max_element(distance.begin(), distance.end()) - distance.begin());
    chosen.push_back(next);
    for (int i = 0; i < num_frames; ++i) {
      int& d = distance[static_cast<size_t>(i)];
      d = std::min(d, std::abs(i - next));
    }
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

}  // namespace vggtcd
