// SPDX-License-Identifier: Apache-2.0
// Change by free-space reasoning: a point is gone when the other epoch's photos that should see it
// look through it; a point that none of them could see is not observed, and is never called
// changed.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "vggtcd/change/change_label.h"
#include "vggtcd/change/nearest_distance.h"
#include "vggtcd/core/options.h"
#include "vggtcd/core/progress.h"
#include "vggtcd/geometry/sim3.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

struct FreeSpaceOptions {
  int max_views = 12;  // photos of the other epoch asked about a photo; >= 1
  double min_confidence_rank =
      0.1;  // share of the least confident pixels that may not testify, [0, 1)
  double tolerance_sigmas = 4.0;   // a gap counts beyond this many sigmas of the scene's gaps; > 0
  double min_through_share = 0.5;  // of the votes that say "gone", to call it changed; (0, 1]
  double min_votes = 1.0;          // fused votes below this: unobserved; > 0
  int fusion_grid = 400;           // voxels along the extent in which votes are fused; >= 1
  int median_radius_px = 1;        // of the label filter in the photo; 0 turns it off

  static constexpr auto fields = [](auto&& self, auto&& field) {
    field("max_views", self.max_views,
          "Free space: photos of the other epoch that are asked about each photo, best overlap "
          "first.");
    field("min_confidence_rank", self.min_confidence_rank,
          "Free space: this share of the least confident pixels gives no testimony.");
    field(
        "tolerance_sigmas", self.tolerance_sigmas,
        "Free space: a depth gap counts when it exceeds this many sigmas of the scene's own gaps.");
    field("min_through_share", self.min_through_share,
          "Free space: share of the votes that must look through a point to call it changed.");
    field("min_votes", self.min_votes, "Free space: with fewer votes a point is unobserved.");
    field("fusion_grid", self.fusion_grid,
          "Free space: voxels along the scene in which votes are fused.");
    field("median_radius_px", self.median_radius_px,
          "Free space: radius of the median filter in a photo.");
  };
  void validate() const;
};

// The testimony about one epoch, per pixel of its photos, all [S, H, W].
struct EpochFreeSpace {
  std::vector<ChangeLabel> label;
  // Signed gap: how far the other epoch sees beyond the point along its rays (T2 units), the fused
  // mean; positive: looked through. NaN without votes.
  std::vector<float> gap;
  std::vector<float> votes;          // fused number of photos that could tell
  std::vector<float> through_share;  // of them that look through; NaN without votes
};

struct FreeSpaceChange {
  EpochFreeSpace t1, t2;
  double gap_sigma = 0;  // robust sigma of relative gaps (gap / depth) between agreeing surfaces
  double scene_extent_u = 0;  // T2
};

// Lets the labels decide: moves them into the distance result, where pixels without a score have no
// evidence, and counts anew.
void decide_by_labels(FreeSpaceChange free_space, ChangeSet& changes);

// Each photo of an epoch asks the photos of the other one that overlap it most. A point X at depth
// z in the other photo, whose depths in the 3 x 3 pixels around its projection span [lo, hi]:
//   lo - z > tolerance * z: the photo looks through X, a vote for change with gap lo - z;
//   z - hi > tolerance * z: X is hidden behind something, no vote;
//   otherwise the photo sees X's surface, a vote against.
// Votes are summed over the points of a voxel before they are read back, so photos of one epoch
// agree.
FreeSpaceChange free_space_changes(const Reconstruction& before, const Reconstruction& after,
                                   const Sim3& t2_from_t1, const FreeSpaceOptions& options,
                                   ProgressSink& progress = silent_progress());

}  // namespace vggtcd
