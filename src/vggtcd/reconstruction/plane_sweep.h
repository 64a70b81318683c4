// SPDX-License-Identifier: Apache-2.0
// Depth of one photo from its neighbours: plane sweep in inverse depth, scored by zero-mean
// normalised cross-correlation (Collins 1996; Gallup et al. 2007).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "vggtcd/geometry/pinhole.h"
#include "vggtcd/geometry/rigid3.h"

namespace vggtcd {

// A photo without distortion, as brightness.
struct GrayView {
  Pinhole pinhole;
  Rigid3 camera_from_world;
  std::vector<float> gray;     // [H, W], 0..255
  std::vector<uint8_t> valid;  // [H, W], 0 where the photo does not reach
};

struct SweepOptions {
  int num_planes = 128;      // a multiple of 16
  int window_radius_px = 3;  // correlation over 7 x 7 px
  int best_views = 2;        // a plane's score is the mean over the best this many source views
};

// The planes: inverse depth nearest_inverse at plane 0, evenly down to farthest_inverse.
struct InverseDepthRange {
  double nearest_inverse = 0;   // 1 / smallest depth
  double farthest_inverse = 0;  // 1 / largest depth, > 0
  int num_planes = 0;
  double inverse_depth(double plane) const {
    return nearest_inverse + (farthest_inverse - nearest_inverse) * plane / (num_planes - 1);
  }
};

// Matching costs [H, W, planes]: 0 for correlation 1, 127 for -1, 64 where nothing can be said
// (no texture, or seen by no source view).
constexpr int kUnknownCost = 64;
std::vector<uint8_t> sweep_planes(const GrayView& reference,
                                  const std::vector<const GrayView*>& sources,
                                  const InverseDepthRange& range, const SweepOptions& options);

}  // namespace vggtcd
