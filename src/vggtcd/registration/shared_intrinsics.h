// SPDX-License-Identifier: Apache-2.0
// The authors' variant in which all frames of a pass share the first frame's intrinsics.
#pragma once

#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

// Gives every view the focal lengths and principal point of view 0 and multiplies its depths by the
// mean of the two focal ratios reference / own, which keeps the size of what it shows.
void share_intrinsics(Reconstruction& reconstruction);

}  // namespace vggtcd
