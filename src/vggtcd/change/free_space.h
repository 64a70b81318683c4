// SPDX-License-Identifier: Apache-2.0
// Change by free-space reasoning: a point is gone when the other epoch's photos that should see it
// look through it; a point that none of them could see is not observed, and is never called
// changed.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "vggtcd/change/change_label.h"
#include "vggtcd/change/explanation.h"
#include "vggtcd/change/nearest_distance.h"
#include "vggtcd/core/options.h"
#include "vggtcd/core/progress.h"
#include "vggtcd/geometry/sim3.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

struct FreeSpaceOptions {
  int max_views = 16;  // photos of the other epoch asked about a photo; >= 1
  double min_confidence_rank =
      0.1;                  // share of the least confident pixels that may not testify, [0, 1)
  bool align_pairs = true;  // removes what is left of pose and scale errors, pair by pair
  double tolerance_sigmas = 4.0;   // a gap counts beyond this many sigmas of its pair; > 0
  double max_pair_sigma = 0.04;    // relative; pairs that agree less give no testimony; > 0
  double min_through_share = 0.6;  // of the votes that say "gone", to call it changed; (0, 1]
  double min_votes = 1.0;          // fused votes below this: unobserved; > 0
  int fusion_grid = 100;           // voxels along the extent in which votes are fused; >= 1
  int smooth_radius = 3;  // in steps of 1/260 of the photo's width, votes of one surface; 0: off
  bool fill = true;       // pixels that may not testify take the answer of the surface around them
  int median_radius_px = 1;  // of the label filter in the photo; 0 turns it off

  static constexpr auto fields = [](auto&& self, auto&& field) {
    field("max_views", self.max_views,
          "Free space: photos of the other epoch that are asked about each photo, best overlap "
          "first.");
    field("min_confidence_rank", self.min_confidence_rank,
          "Free space: this share of the least confident pixels gives no testimony.");
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

// The testimony about one epoch, per pixel of its photos, all [S, H, W]. Fused over voxels and the
// surface around a pixel; NaN without enough votes.
struct EpochFreeSpace {
  std::vector<ChangeLabel> label;
  // Signed gap: how far the other epoch sees beyond the point along its rays (T2 units), the mean;
  // positive: looked through.
  std::vector<float> gap;
  // The mean gap in sigmas of the pairs, each held between -8 and 8: ranks best.
  std::vector<float> evidence;
  // The probability, 0 to 1, that the share of votes is on the side of its threshold that the label
  // says, from the number of photos that voted and how they disagree.
  std::vector<float> confidence;
  // Smallest distance that is significant at 95 % here, T2 units: 1.96 sqrt(sigma^2 / n + r^2),
  // sigma the spread of the gaps of both photos of a pair where nothing changed, n the photos that
  // voted, r the uncertainty of the registration (M3C2: Lague et al. 2013, eq. 1, with one sigma
  // for both epochs).
  std::vector<float> level_of_detection;
};

struct FreeSpaceChange {
  EpochFreeSpace t1, t2;
  double gap_sigma = 0;        // median over the pairs of photos of their relative sigma
  double surface_sigma_u = 0;  // the same at the median depth, T2 units
  double scene_extent_u = 0;   // T2
  std::optional<PixelExplanation> explanation;  // of the pixel that was asked about
};

// Lets the labels decide: moves them into the distance result, where pixels without a score have no
// evidence, and counts anew.
void decide_by_labels(FreeSpaceChange free_space, ChangeSet& changes);

// Each photo of an epoch asks the photos of the other one that overlap it most; each pair is
// aligned once more (pair_alignment.h), which also gives its relative sigma. A point X at depth z
// in the other photo, whose depths in the 3 x 3 pixels around its projection span [lo, hi], with t
// = tolerance_sigmas * sigma * z:
//   lo - z > t: the photo looks through X, a vote for change with gap lo - z;
//   z - hi > t: X is hidden behind something, no vote;
//   otherwise the photo sees X's surface, a vote against.
// Near photos weigh more, as 1 / z. Votes are summed over the points of a voxel, so photos of one
// epoch agree, and over the surface around a pixel. registration_sigma_u: see level_of_detection.
// question: a pixel whose votes are kept in `explanation`.
FreeSpaceChange free_space_changes(const Reconstruction& before, const Reconstruction& after,
                                   const Sim3& t2_from_t1, const FreeSpaceOptions& options,
                                   double registration_sigma_u = 0,
                                   ProgressSink& progress = silent_progress(),
                                   const PixelQuestion* question = nullptr);

}  // namespace vggtcd
