// SPDX-License-Identifier: Apache-2.0
// Inquiry: the points of one epoch before the photos of the other: who is asked, how each pair of
// photos agrees, and the votes of all.
#pragma once

#include <memory>
#include <vector>

#include "vggtcd/change/vote_grid.h"
#include "vggtcd/change/vote_tally.h"
#include "vggtcd/change/witness.h"
#include "vggtcd/geometry/sim3.h"
#include "vggtcd/scene/point_cloud.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

inline constexpr double kMinGapSigma = 2e-3;  // of the depth: no network measures depth better

// One direction of the change detection. Refers to the judged epoch and the witness.
class Inquiry {
 public:
  // views[frame]: the photos of the witness that are asked about that photo of the judged epoch.
  // min_confidence: what a pixel of the judged epoch must have to ask. correction: of its depths.
  Inquiry(const Reconstruction& judged, const Sim3& t2_from_judged,
          const DepthCorrection& correction, const Witness& witness,
          std::vector<std::vector<int>> views, float min_confidence);

  const Reconstruction& judged() const { return judged_; }
  const Witness& witness() const { return witness_; }
  const std::vector<int>& views(int frame) const { return views_[static_cast<size_t>(frame)]; }
  bool asks(size_t pixel) const { return testifies(judged_, pixel, min_confidence_); }

  // The rays of a photo's pixels, T2.
  PixelRays rays(int frame) const {
    return PixelRays(judged_.views[static_cast<size_t>(frame)], t2_from_judged_);
  }
  // The point of a pixel with depth, T2.
  Eigen::Vector3f point(int frame, int u, int v) const {
    return point(rays(frame), correction_.photo(static_cast<size_t>(frame)), frame, u, v);
  }

  // Appends relative gaps (window centre - z) / z of a sparse sample: how well unchanged surfaces
  // agree.
  void sample_gaps(std::vector<float>& gaps) const;

  // Gives every pair this sigma (relative).
  void set_sigma(double sigma);
  // Aligns every pair once more (pair_alignment.h), which gives it a sigma of its own; pairs above
  // max_sigma give no testimony from then on.
  void align_pairs(double gate, double scene_extent_u, double max_sigma);
  // Appends the sigmas of all pairs.
  void add_sigmas(std::vector<float>& sigmas) const;

  // The votes about every point that asks, fused over voxels. Grows the voxels if there are too
  // many.
  std::unique_ptr<VoteGrid> vote(const VoteScale& scale, double voxel_size) const;

  // visit(pixel, x_in_t2) for each point of a frame that asks, every stride-th row and column.
  template <typename Visit>
  void for_each_point(int frame, int stride, Visit&& visit) const {
    const PixelRays rays_of_frame = rays(frame);
    const PhotoCorrection correction = correction_.photo(static_cast<size_t>(frame));
    const size_t first = static_cast<size_t>(frame) * judged_.pixels_per_frame();
    for (int v = 0; v < judged_.height; v += stride) {
      for (int u = 0; u < judged_.width; u += stride) {
        const size_t pixel = first + static_cast<size_t>(v) * static_cast<size_t>(judged_.width) +
                             static_cast<size_t>(u);
        if (asks(pixel)) visit(pixel, point(rays_of_frame, correction, frame, u, v));
      }
    }
  }

  // visit(k, testimony) for each photo views(frame)[k] that is asked about this frame.
  template <typename Visit>
  void for_each_witness(int frame, const Eigen::Vector3f& x, float tolerance_sigmas,
                        Visit&& visit) const {
    const size_t i = static_cast<size_t>(frame);
    for (size_t k = 0; k < views_[i].size(); ++k) {
      const DepthWindows photo = witness_.windows(static_cast<size_t>(views_[i][k]));
      visit(k, ask(pairs_[i][k], photo, x, tolerance_sigmas, witness_.open_gap_u));
    }
  }

 private:
  Eigen::Vector3f point(const PixelRays& rays_of_frame, const PhotoCorrection& correction,
                        int frame, int u, int v) const {
    const size_t in_frame =
        static_cast<size_t>(v) * static_cast<size_t>(judged_.width) + static_cast<size_t>(u);
    return rays_of_frame.point(u, v,
                               judged_.frame_depth(frame)[in_frame] * correction.factor(u, v));
  }

  const Reconstruction& judged_;
  Sim3 t2_from_judged_;
  const DepthCorrection& correction_;
  const Witness& witness_;
  std::vector<std::vector<int>> views_;
  float min_confidence_;
  std::vector<std::vector<PairProjection>> pairs_;  // [frame][k], with views_[frame][k]
};

}  // namespace vggtcd
