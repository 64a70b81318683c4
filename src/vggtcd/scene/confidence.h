// SPDX-License-Identifier: Apache-2.0
// Confidence is only ever ranked: thresholds are its median or another percentile.
#pragma once

#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

// The value that "confident" pixels exceed: the median confidence (numpy's: mean of the two middle
// values) over the pixels that have depth. Where no pixel exceeds the median, because half of them
// or more share the largest value (a source without confidences), the next smaller float, so that
// those are kept. Throws Error{kDegenerate} if no pixel has depth.
float confidence_threshold(const Reconstruction& reconstruction);

// The percentile (0 to 100, numpy's) of the confidence over the pixels that have depth. Throws
// Error{kDegenerate} if no pixel has.
float confidence_percentile(const Reconstruction& reconstruction, double percent);

}  // namespace vggtcd
