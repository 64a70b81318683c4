// SPDX-License-Identifier: Apache-2.0
// The photo of a frame, as the reconstruction keeps it.
#pragma once

#include "vggtcd/scene/image.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

// A copy of the frame's colours, [H, W, 3].
Image frame_image(const Reconstruction& reconstruction, int frame);

}  // namespace vggtcd
