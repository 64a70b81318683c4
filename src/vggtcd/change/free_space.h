// SPDX-License-Identifier: Apache-2.0
// Change by free-space reasoning: a point is gone when the other epoch's photos that should see it
// look through it; a point that none of them could see is not observed, and is never called
// changed.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "vggtcd/change/change_label.h"
#include "vggtcd/change/explanation.h"
#include "vggtcd/change/free_space_options.h"
#include "vggtcd/change/nearest_distance.h"
#include "vggtcd/change/photo_answers.h"
#include "vggtcd/core/progress.h"
#include "vggtcd/geometry/point_variance.h"
#include "vggtcd/geometry/sim3.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

// The testimony about one epoch: what is needed to go on. All else is handed over photo by photo.
struct EpochFreeSpace {
  std::vector<ChangeLabel> label;  // [S, H, W]
  // Of the pixels called changed alone, in pixel order; as in PhotoAnswers.
  std::vector<float> changed_confidence, changed_evidence;
};

struct FreeSpaceChange {
  EpochFreeSpace t1, t2;
  double gap_sigma = 0;        // median over the pairs of photos of their relative sigma
  double surface_sigma_u = 0;  // the same at the median depth, T2 units
  double scene_extent_u = 0;   // T2
  std::optional<PixelExplanation> explanation;  // of the pixel that was asked about
};

// Receives the answers about every photo of either epoch, each photo once, as soon as they are
// final: in any order, from several threads at a time. Five arrays for every pixel of both epochs
// would be larger than the epochs.
struct PhotoAnswersSink {
  std::function<void(int frame, const PhotoAnswers&)> t1, t2;  // may be empty
};

// Lets the labels decide: moves them into the distance result, where pixels without a score have no
// evidence, and counts anew.
void decide_by_labels(FreeSpaceChange free_space, ChangeSet& changes);

// First each photo's depths give up what the others of its epoch do not confirm
// (depth_consensus.h). Each photo of an epoch asks the photos of the other one that overlap it
// most; each pair is aligned once more (pair_alignment.h), which also gives its relative sigma. A
// point X at depth z in the other photo, whose depths in the 3 x 3 pixels around its projection
// span [lo, hi] (taken at half its width where the window shows one surface), with
// t = tolerance_sigmas * sigma * z:
//   lo - z > t: the photo looks through X, a vote for change with gap lo - z;
//   z - hi > t: X is hidden behind something, no vote;
//   otherwise the photo sees X's surface, a vote against.
// A photo that shows the open sky around the projection looks through X too, by the extent of the
// scene. Near photos weigh more, as 1 / z. Votes are summed over the points of a voxel, so photos
// of one epoch agree, and over the surface around a pixel. registration: that of t2_from_t1, see
// level_of_detection. question: a pixel whose votes are kept in `explanation`.
FreeSpaceChange free_space_changes(const Reconstruction& before, const Reconstruction& after,
                                   const Sim3& t2_from_t1, const FreeSpaceOptions& options,
                                   const PointVariance& registration = {},
                                   ProgressSink& progress = silent_progress(),
                                   const PixelQuestion* question = nullptr,
                                   const PhotoAnswersSink& sink = {});

}  // namespace vggtcd
