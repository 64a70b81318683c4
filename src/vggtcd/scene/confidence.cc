// SPDX-License-Identifier: Apache-2.0
// Confidence is only ever ranked: the one threshold of the method is its median.
#include "vggtcd/scene/confidence.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "vggtcd/core/error.h"
#include "vggtcd/geometry/order_statistics.h"

namespace vggtcd {

float confidence_threshold(const Reconstruction& reconstruction) {
  std::vector<float> values;
  values.reserve(reconstruction.num_pixels());
  for (size_t i = 0; i < reconstruction.num_pixels(); ++i) {
    if (reconstruction.depth[i] > 0) values.push_back(reconstruction.confidence[i]);
  }
  if (values.empty()) {
    throw_error(ErrorCode::kDegenerate, "no pixel of any of the {} frames has depth",
                reconstruction.num_frames());
  }
  const float threshold = static_cast<float>(median(values));
  const float largest = *std::max_element(values.begin(), values.end());
  if (threshold < largest) return threshold;
  return std::nextafter(largest, -std::numeric_limits<float>::infinity());
}

}  // namespace vggtcd
