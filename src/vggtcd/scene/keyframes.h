// SPDX-License-Identifier: Apache-2.0
// Keyframe selection by farthest point sampling in index space (Eq. 2 of the paper).
#pragma once

#include <vector>

namespace vggtcd {

// The 0-based frame numbers of count keyframes out of num_frames, ascending. Starts with frame 0
// and adds, one by one, the frame whose nearest chosen frame is farthest away; of equals the
// earliest. All frames if count >= num_frames. Throws Error{kUsage} unless num_frames >= 1 and
// count >= 1.
std::vector<int> select_keyframes(int num_frames, int count);

}  // namespace vggtcd
