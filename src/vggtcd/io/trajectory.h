// SPDX-License-Identifier: Apache-2.0
// Camera trajectories from whatever file has them: NumPy poses, COLMAP models, TUM files.
#pragma once

#include <filesystem>
#include <span>

#include "vggtcd/io/named_pose.h"

namespace vggtcd {

// What the matrices of a .npy file mean. COLMAP and TUM files say it themselves.
enum class PoseConvention { kCameraFromWorld, kWorldFromCamera };

// Decides by the name: a .npy file of (N, 4, 4) or (N, 3, 4) poses, a directory with a COLMAP
// model, an images.txt or images.bin of one, otherwise a TUM file. NumPy poses are named 0, 1, ...;
// COLMAP's come in the order of their names. Throws Error{kInput}.
Trajectory read_trajectory(const std::filesystem::path& path, PoseConvention npy_convention);

// Writes (N, 4, 4) f64. Throws Error{kOutput}.
void write_npy_poses(const std::filesystem::path& path, std::span<const NamedPose> trajectory,
                     PoseConvention convention);

}  // namespace vggtcd
