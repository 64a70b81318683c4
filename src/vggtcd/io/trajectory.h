// SPDX-License-Identifier: Apache-2.0
// Camera trajectories from whatever file has them: NumPy poses, COLMAP models, TUM files.
#pragma once

#include <filesystem>
#include <span>

#include "vggtcd/io/named_pose.h"

namespace vggtcd {

// What the matrices of a .npy file mean. COLMAP and TUM files say it themselves.
enum class PoseConvention { kCameraFromWorld, kWorldFromCamera };

// What the names of poses are worth when two files are compared.
enum class PoseNames {
  kNumbers,     // 0, 1, 2, ... in the order of the file: the order is all that is known
  kTimeStamps,  // numbers, as TUM files have them
  kPhotos       // names of photos, COLMAP's
};

struct TrajectoryFile {
  Trajectory poses;
  PoseNames names = PoseNames::kNumbers;
};

// Decides by the name: a .npy file of (N, 4, 4) or (N, 3, 4) poses, a directory with a COLMAP
// model, an images.txt or images.bin of one, otherwise a TUM file. NumPy poses are named 0, 1, ...;
// COLMAP's come in natural order of their names. Throws Error{kInput}.
TrajectoryFile read_trajectory_file(const std::filesystem::path& path,
                                    PoseConvention npy_convention);
// The poses alone.
Trajectory read_trajectory(const std::filesystem::path& path, PoseConvention npy_convention);

// Writes (N, 4, 4) f64. Throws Error{kOutput}.
void write_npy_poses(const std::filesystem::path& path, std::span<const NamedPose> trajectory,
                     PoseConvention convention);

}  // namespace vggtcd
