// SPDX-License-Identifier: Apache-2.0
// Dense depth of every photo from its neighbours of the same epoch: plane sweep, semi-global
// aggregation, and agreement between the photos.
#pragma once

#include <vector>

#include "vggtcd/core/progress.h"
#include "vggtcd/reconstruction/plane_sweep.h"
#include "vggtcd/reconstruction/semi_global.h"
#include "vggtcd/reconstruction/view_selection.h"

namespace vggtcd {

struct DenseDepthOptions {
  SweepOptions sweep;
  SemiGlobalOptions semi_global;
  // Two photos agree on a point if their inverse depths differ by at most this share, or by
  // max_difference_planes of the sweep's planes, whichever is more.
  double max_relative_difference = 0.01;
  double max_difference_planes = 1.0;
  int min_patch_px =
      120;  // smaller connected patches of depth are chance agreements, e.g. in a sky
  int min_agreeing_views = 2;  // besides the photo itself; 1 if it has but one or two sources
  // What a single other photo confirms counts only if both found it distinctly better than any
  // other depth: on a ribbed cloth two photos agree on the wrong rib.
  double min_lone_distinctness = 0.25;
};

// Depth 0: unknown.
struct DepthMap {
  std::vector<float> depth;       // [H, W], units of the cameras
  std::vector<float> confidence;  // [H, W]: agreeing photos + how distinct the plane was, in [0, 1)
};

// Depth by one sweep, before agreement: the aggregated costs' smallest plane, refined between
// planes by a parabola; confidence is how much worse the best plane elsewhere is.
DepthMap sweep_depth(const GrayView& reference, const std::vector<const GrayView*>& sources,
                     const InverseDepthRange& range, const DenseDepthOptions& options);

// Keeps the pixels of a view on which enough of its sources agree, their inverse depths averaged.
DepthMap agreed_depth(size_t view, const std::vector<GrayView>& views,
                      const std::vector<DepthMap>& swept, const std::vector<DepthTask>& tasks,
                      const DenseDepthOptions& options);

// Forgets patches of fewer than min_patch_px pixels; neighbours are connected when their depths
// differ by less than 3 %.
void remove_small_patches(int width, int height, int min_patch_px, DepthMap& map);

// All three, for all views; a view without sources has no depth.
std::vector<DepthMap> dense_depth(const std::vector<GrayView>& views,
                                  const std::vector<DepthTask>& tasks,
                                  const DenseDepthOptions& options, ProgressStage& stage);

}  // namespace vggtcd
