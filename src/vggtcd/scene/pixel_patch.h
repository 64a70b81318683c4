// SPDX-License-Identifier: Apache-2.0
// Connected patches of the pixels of a photo.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace vggtcd {

// Fills `patch` with the pixels that are connected to `seed` through neighbours to the left, right,
// above and below, the seed first, and marks them in `visited` ([H, W]; what is marked already is
// left out). belongs(from, to): whether a pixel joins one that is in the patch.
template <typename Belongs>
void grow_patch(size_t seed, int width, int height, std::vector<uint8_t>& visited,
                std::vector<size_t>& patch, const Belongs& belongs) {
  const auto w = static_cast<size_t>(width), h = static_cast<size_t>(height);
  patch.assign(1, seed);
  visited[seed] = 1;
  for (size_t next = 0; next < patch.size(); ++next) {
    const size_t from = patch[next];
    const auto visit = [&](bool inside, size_t to) {
      if (!inside || visited[to] != 0 || !belongs(from, to)) return;
      visited[to] = 1;
      patch.push_back(to);
    };
    visit(from % w > 0, from - 1);
    visit(from % w + 1 < w, from + 1);
    visit(from >= w, from - w);
    visit(from / w + 1 < h, from + w);
  }
}

}  // namespace vggtcd
