// SPDX-License-Identifier: Apache-2.0
// Where cameras are known to have stood: a table, a COLMAP model, or a TUM trajectory, in metres.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

namespace vggtcd {

struct ReferenceCamera {
  std::string name;  // as the file has it: a photo, or a number
  Eigen::Vector3d center_m = Eigen::Vector3d::Zero();
};

// A directory with a COLMAP model or one of its images.txt, images.bin: camera centres. Otherwise a
// table (camera_table.h); eight numbers a line are TUM's "timestamp tx ty tz qx qy qz qw", the name
// is the time stamp then. Throws Error{kInput} naming file and line, also for a name that comes
// twice.
std::vector<ReferenceCamera> read_reference_cameras(const std::filesystem::path& path);

}  // namespace vggtcd
