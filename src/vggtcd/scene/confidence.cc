// SPDX-License-Identifier: Apache-2.0
// Confidence is only ever ranked: thresholds are its median or another percentile.
#include "vggtcd/scene/confidence.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "vggtcd/core/error.h"
#include "vggtcd/geometry/order_statistics.h"

namespace vggtcd {

namespace {

// The confidences of the pixels that have depth; copied only if some pixel has none. At least one.
class ConfidencesWithDepth {
 public:
  explicit ConfidencesWithDepth(const Reconstruction& r) : values_(r.confidence) {
    if (!std::ranges::all_of(r.depth, [](float depth) { return depth > 0; })) {
      copy_.reserve(r.num_pixels());
      for (size_t i = 0; i < r.num_pixels(); ++i) {
        if (r.depth[i] > 0) copy_.push_back(r.confidence[i]);
      }
      values_ = copy_;
    }
    if (values_.empty()) {
      throw_error(ErrorCode::kDegenerate, "no pixel of any of the {} frames has depth",
                  r.num_frames());
    }
  }
  std::span<const float> values() const { return values_; }

 private:
  std::vector<float> copy_;
  std::span<const float> values_;
};

}  // namespace

float confidence_threshold(const Reconstruction& reconstruction) {
  const ConfidencesWithDepth with_depth(reconstruction);
  const std::span<const float> values = with_depth.values();
  const float threshold = median(values);
  // Normally found among the first few.
  if (std::ranges::any_of(values, [&](float value) { return value > threshold; })) return threshold;
  return std::nextafter(threshold, -std::numeric_limits<float>::infinity());
}

float confidence_percentile(const Reconstruction& reconstruction, double percent) {
  const double percents[] = {percent};
  return static_cast<float>(
      percentiles(ConfidencesWithDepth(reconstruction).values(), percents)[0]);
}

}  // namespace vggtcd
