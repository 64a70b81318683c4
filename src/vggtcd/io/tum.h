// SPDX-License-Identifier: Apache-2.0
// Trajectories in the format of the TUM RGB-D benchmark, as evo reads it: a line per camera,
// "timestamp tx ty tz qx qy qz qw", the pose world-from-camera.
#pragma once

#include <filesystem>
#include <string_view>

#include "vggtcd/io/named_pose.h"

namespace vggtcd {

// The time stamp is the position in the list, 0, 1, ...; numbers are written so that they read
// back exactly. A comment (one line) goes first. Throws Error{kOutput}.
void write_tum(const std::filesystem::path& path, const Trajectory& trajectory,
               std::string_view comment = {});

// Names are the time stamps as text. Lines that begin with # are comments. Throws Error{kInput}.
Trajectory read_tum(const std::filesystem::path& path);

}  // namespace vggtcd
