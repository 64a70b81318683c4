// SPDX-License-Identifier: Apache-2.0
// pose_pairs: which pose of one trajectory file is which of another.
#pragma once

#include <string>
#include <vector>

#include "vggtcd/geometry/rigid3.h"
#include "vggtcd/io/trajectory.h"

namespace vggtcd {

// predicted[k] belongs to truth[k], in the order of time or of the photos' names.
struct PosePairs {
  std::vector<Rigid3> predicted, truth;
  size_t predicted_alone = 0, truth_alone = 0;  // poses without a partner
};

// Two files with names of photos are paired by name (folders are ignored where whole names have
// nothing in common), two with time stamps by the nearest stamp within 0.01 s, as evo does; where
// one has only an order, both are taken in order, and then the numbers of poses may differ and the
// caller must look. A file that counts 0, 1, 2, ... has only an order, unless the other's stamps
// are such numbers, too. Names that have nothing in common are no names: order again. Throws
// Error{kInput} if time stamps have nothing in common, come twice, or do not rise where the order
// counts; the names of the files are for messages.
PosePairs pair_poses(const TrajectoryFile& predicted, const std::string& predicted_file,
                     const TrajectoryFile& truth, const std::string& truth_file);

}  // namespace vggtcd
