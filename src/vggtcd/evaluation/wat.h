// SPDX-License-Identifier: Apache-2.0
// The WAT benchmark's folder layout: SCENE/images/SEQUENCE/*.jpg, SCENE/sparse/0 of COLMAP with
// images named SEQUENCE/FILE (docs/benchmark.md).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "vggtcd/evaluation/trajectory_metrics.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

struct WatSequence {
  std::string name;                 // the folder
  std::vector<std::string> photos;  // file names in it, sorted
};

// The sequences of a scene in the order of their names: the first is T1, the second T2. Throws
// Error{kInput} if there are fewer than two folders with photos.
std::vector<WatSequence> list_wat_sequences(const std::filesystem::path& scene_directory);

// The scenes of a data directory: those with images/ and sparse/0, in the paper's order, then by
// name. Throws Error{kInput} if there is none.
std::vector<std::string> list_wat_scenes(const std::filesystem::path& data);

// The photos of the two sequences that COLMAP registered: what is to be predicted.
struct WatPhotos {
  std::vector<std::filesystem::path> before, after;
};
WatPhotos list_wat_photos(const std::filesystem::path& scene_directory);

// The prediction file of a joint pass over K keyframes per epoch, for the ablation: joint_5.npz,
// and joint_all.npz for 0.
std::string wat_joint_name(int keyframes);

// The true poses for the frames of both predictions. Frames are matched to COLMAP's images by name
// (SEQUENCE/NAME); where the predictions carry no names, by order, if the numbers agree. Frames
// that COLMAP did not register are an error that names the first one.
BitemporalTrajectory read_wat_truth(const std::filesystem::path& scene_directory,
                                    const Reconstruction& before, const Reconstruction& after);

}  // namespace vggtcd
