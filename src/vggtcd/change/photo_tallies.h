// SPDX-License-Identifier: Apache-2.0
// PhotoTallies: the fused votes about the pixels of one photo, and their sums over the surface
// around a pixel.
#pragma once

#include <vector>

#include "vggtcd/change/inquiry.h"
#include "vggtcd/change/vote_grid.h"
#include "vggtcd/change/vote_tally.h"

namespace vggtcd {

class PhotoTallies {
 public:
  PhotoTallies(const Inquiry& inquiry, int frame, const VoteGrid& grid, const VoteScale& scale);

  // Whether the pixel's own point asked.
  bool asked(int u, int v) const { return tallies_[index(u, v)].points > 0; }

  // The votes of the pixels around that show the same surface, radius in steps of 1/260 of the
  // photo's width; no points where none of them asked.
  Tally around(int u, int v, int radius) const;

 private:
  size_t index(int u, int v) const {
    return static_cast<size_t>(v) * static_cast<size_t>(width_) + static_cast<size_t>(u);
  }

  int width_, height_;
  std::span<const float> depth_;
  std::vector<Tally> tallies_;  // no points where a pixel may not ask
};

}  // namespace vggtcd
