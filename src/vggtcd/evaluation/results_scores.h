// SPDX-License-Identifier: Apache-2.0
// Results of detect on a generated scene against its truth: cameras and change per pixel.
#pragma once

#include <filesystem>
#include <string>

#include "vggtcd/evaluation/change_metrics.h"
#include "vggtcd/evaluation/trajectory_metrics.h"

namespace vggtcd {

// The true cameras of a generated scene: extrinsic_t1 and extrinsic_t2 of truth.npz. Throws
// Error{kInput}.
BitemporalTrajectory read_true_cameras(const std::filesystem::path& truth_npz);

// Counted over the pixels of the truth, void ones left out, but for the sky: where the results say
// anything about it, it counts as unchanged. A pixel without evidence in the
// results, because of its confidence or because its photo is not among them, is not called changed.
// The decision is that of the results. The ranking for average precision goes by the distance, or
// where photos voted by the gap in sigmas (evidence_* of change.npz): then every pixel that has a
// label has evidence, and what nobody could see ranks last.
struct ResultsScores {
  int frames_t1 = 0, frames_t2 = 0;            // of the results
  int true_frames_t1 = 0, true_frames_t2 = 0;  // of the truth
  TrajectoryErrors cameras;                    // of the frames of the results
  ChangeScores evidence;                       // pixels with evidence on surface both epochs saw
  ChangeScores every_pixel;                    // the same, and pixels without evidence
  double evidence_share = 0;                   // of the pixels of surface both epochs saw
  double unseen_called_changed = 0;  // of unchanged surface that the other epoch never saw
  // The frames with most pixels that are rightly called changed, as in the results' colmap/.
  std::string most_changed_t1, most_changed_t2;
};

// `results` is a directory that detect wrote, from photos named by their frame number (0003.jpg) or
// from as many frames as the truth has. Photos are larger than the truth's maps or smaller; frames
// show their middle, as large as fits. Throws Error{kInput}.
ResultsScores score_results(const std::filesystem::path& results,
                            const std::filesystem::path& truth_npz);

}  // namespace vggtcd
