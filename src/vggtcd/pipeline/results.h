// SPDX-License-Identifier: Apache-2.0
// The files that detect and register leave behind; docs/formats.md describes each one.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "vggtcd/change/explanation.h"
#include "vggtcd/change/instances.h"
#include "vggtcd/change/nearest_distance.h"
#include "vggtcd/io/json_file.h"
#include "vggtcd/pipeline/alignment.h"
#include "vggtcd/pipeline/answer_store.h"
#include "vggtcd/pipeline/result_frame.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

// sim3.json: the chosen similarity at the top level, then each stage's, and metres_from_t2 with its
// standard deviations where metres are known.
Json sim3_json(const Alignment& alignment, const std::optional<Metric>& metric);

// The "alignment" part of summary.json: verdict, counts, residuals.
Json alignment_json(const Alignment& alignment);

// The "change" part: thresholds and counts.
Json change_json(const ChangeSet& changes, const ResultFrame& frame);

// explain.json: which photos voted how for one pixel.
Json explanation_json(const PixelExplanation& explanation, const ResultFrame& frame);

// All functions below write into an existing directory and throw Error{kOutput}. Changes and
// instances are expressed in the frame of the results already (result_frame.h).

// A point of every pixel with evidence, in the frame of the results: colour, change_distance,
// changed, confidence, and where labels decide what the votes said (`answers`, else null).
void write_change_ply(const std::filesystem::path& path, const Reconstruction& epoch,
                      const Sim3& result_from_epoch, const EpochChange& change,
                      const ChangeSet& changes, const StoredAnswers* answers,
                      const ResultFrame& frame);

// change.npz: score, changed, instance, and where labels decide the label and the answers (else
// null); all [S, H, W] of either epoch.
void write_change_npz(const std::filesystem::path& path, const Reconstruction& before,
                      const Reconstruction& after, const ChangeSet& changes,
                      const ChangeInstances& instances, const AnswerStore* answers,
                      const ResultFrame& frame);

// One PNG per photo into `directory`, named like the photo: beside it its distances or, where
// labels decide, its answers.
void write_overlays(const std::filesystem::path& directory, const Reconstruction& epoch,
                    const EpochChange& change, const ChangeSet& changes);

// The views of an epoch with their poses in another frame.
std::vector<View> views_in(const Reconstruction& epoch, const Sim3& frame_from_epoch,
                           const std::string& name_prefix);

// cameras_before.tum, cameras_after.tum and colmap/ (text) of the cameras of both epochs.
void write_cameras(const std::filesystem::path& directory, const Reconstruction& before,
                   const Reconstruction& after, const Sim3& t2_from_t1, const ResultFrame& frame);

// The layout of the authors' inference script, so that their evaluator runs unchanged:
// {coarse,fine}_sim3.npz with s, R, t; pred_poses_{t1,t2}.npy (N,4,4) camera-from-world in each
// epoch's own frame; timing.json.
void write_authors_layout(const std::filesystem::path& directory, const Reconstruction& before,
                          const Reconstruction& after, const Alignment& alignment,
                          const StageLog& log);

}  // namespace vggtcd
