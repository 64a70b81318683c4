// SPDX-License-Identifier: Apache-2.0
// NamedPose: what trajectory files hold.
#pragma once

#include <string>
#include <vector>

#include "vggtcd/geometry/rigid3.h"

namespace vggtcd {

struct NamedPose {
  std::string name;  // photo, time stamp or number, as the file has it
  Rigid3 camera_from_world;
};

using Trajectory = std::vector<NamedPose>;

}  // namespace vggtcd
