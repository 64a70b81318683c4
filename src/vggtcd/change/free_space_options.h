// SPDX-License-Identifier: Apache-2.0
// Options of the change detection by free-space votes.
#pragma once

#include "vggtcd/core/options.h"

namespace vggtcd {

struct FreeSpaceOptions {
  int max_views = 16;  // photos of the other epoch asked about a photo; >= 1
  double min_confidence_rank =
      0.1;                  // share of the least confident pixels that may not testify, [0, 1)
  bool consensus = true;    // takes off what the other photos of an epoch do not confirm
  bool align_pairs = true;  // removes what is left of pose and scale errors, pair by pair
  double tolerance_sigmas = 4.0;   // a gap counts beyond this many sigmas of its pair; > 0
  double max_pair_sigma = 0.04;    // relative; pairs that agree less give no testimony; > 0
  double min_through_share = 0.6;  // of the votes that say "gone", to call it changed; (0, 1]
  double min_votes = 1.0;          // fused votes below this: unobserved; > 0
  int fusion_grid = 100;           // voxels along the extent in which votes are fused; >= 1
  int smooth_radius = 2;  // in steps of 1/260 of the photo's width, votes of one surface; 0: off
  bool fill = true;       // pixels that may not testify take the answer of the surface around them
  int median_radius_px = 1;  // of the label filter in the photo; 0 turns it off

  static constexpr auto fields = [](auto&& self, auto&& field) {
    field("max_views", self.max_views,
          "Free space: photos of the other epoch that are asked about each photo, best overlap "
          "first.");
    field("min_confidence_rank", self.min_confidence_rank,
          "Free space: this share of the least confident pixels gives no testimony.");
    field("consensus", self.consensus,
          "Free space: first take off the smooth part of each photo's depths that the other photos "
          "of its epoch do not confirm.");
    field("align_pairs", self.align_pairs,
          "Free space: align each pair of photos once more on the surfaces that agree.");
    field("tolerance_sigmas", self.tolerance_sigmas,
          "Free space: a depth gap counts when it exceeds this many sigmas of its pair of photos.");
    field("max_pair_sigma", self.max_pair_sigma,
          "Free space: pairs of photos whose depths disagree by more than this share give no "
          "testimony.");
    field("min_through_share", self.min_through_share,
          "Free space: share of the votes that must look through a point to call it changed.");
    field("min_votes", self.min_votes, "Free space: with fewer votes a point is unobserved.");
    field("fusion_grid", self.fusion_grid,
          "Free space: voxels along the scene in which votes are fused.");
    field("smooth_radius", self.smooth_radius,
          "Free space: votes are averaged over the same surface this far around a pixel, in steps "
          "of 1/260 of the photo's width.");
    field("fill", self.fill,
          "Free space: pixels that give no testimony take the answer of the surface around them.");
    field("median_radius_px", self.median_radius_px,
          "Free space: radius of the median filter in a photo.");
  };
  void validate() const;
};

}  // namespace vggtcd
