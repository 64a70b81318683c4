// SPDX-License-Identifier: Apache-2.0
// Prediction files of reconstruction networks -> Reconstruction: the .npz files of VGGT,
// VGGT-Omega, MapAnything and Depth Anything 3. Keys and conventions are in docs/formats.md.
#pragma once

#include <filesystem>

#include "vggtcd/core/progress.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

struct PredictionLimits {
  int min_frames = 2;  // fewer: Error{kDegenerate}
};

// Reads one epoch. Depth that is NaN, infinite or negative, and depth whose confidence is not
// a number, becomes 0 (no depth), with one notice; so does depth that is no part of the scene
// (scene/stray_depths.h); frames without any depth are named in a notice. Frames whose pose or
// intrinsics are not finite are left out and named (Reconstruction::left_out); intrinsics of
// another picture size are refused. Where the file's origin is far from the scene the frame is a
// local one (scene/local_frame.h). Where the file has world points, poses and depth are checked
// against them, because the same key means opposite poses in different programs; a file that
// contradicts itself is refused. Throws Error{kInput} for anything else that is not as
// docs/formats.md says.
Reconstruction read_reconstruction(const std::filesystem::path& path, ProgressSink& progress,
                                   const PredictionLimits& limits = {});

// Whether the file holds the photos, images or image; without them colours are grey. Throws
// Error{kInput} if it cannot be read.
bool prediction_has_images(const std::filesystem::path& path);

// What the headers say. Throws Error{kInput} if the file is not a prediction.
struct PredictionSize {
  int frames = 0, width = 0, height = 0;
};
PredictionSize prediction_size(const std::filesystem::path& path);

// Reads the joint pass over keyframes of `before` and `after`: the same, with keyframes_t1 and
// keyframes_t2. Throws Error{kInput} unless these are distinct frame numbers of the two epochs, one
// for each frame, and all three passes have one frame size. Keyframes that one of the files has
// left out are left out.
JointReconstruction read_joint(const std::filesystem::path& path, const Reconstruction& before,
                               const Reconstruction& after, ProgressSink& progress);

// Writes a file that read_reconstruction reads: VGGT's keys extrinsic, intrinsic, depth,
// depth_conf, images (u8, [S, H, W, 3]) and our own names. Throws Error{kOutput}.
void write_reconstruction(const std::filesystem::path& path, const Reconstruction& reconstruction);
// The same with the keyframes.
void write_joint(const std::filesystem::path& path, const JointReconstruction& joint);

}  // namespace vggtcd
