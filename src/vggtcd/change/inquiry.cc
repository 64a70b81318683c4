// SPDX-License-Identifier: Apache-2.0
// Inquiry: the points of one epoch before the photos of the other.
#include "vggtcd/change/inquiry.h"

#include <algorithm>
#include <atomic>

#include "vggtcd/change/pair_alignment.h"
#include "vggtcd/core/parallel.h"

namespace vggtcd {
namespace {

constexpr int kAlignmentPointsAcross = 60;  // points of a photo that align it, along its width
constexpr double kUnitWeight = 16;          // of a vote over a quarter of the scene extent
constexpr double kGapSteps = 1 << 16;       // fixed-point steps of a gap, per scene extent
constexpr int kSigmaStride = 5;             // every 5th row and column is looked at for the gaps

}  // namespace

VoteScale vote_scale(double scene_extent_u, double tolerance_sigmas,
                     const PointVariance& registration) {
  return {scene_extent_u / kGapSteps, static_cast<float>(kUnitWeight * scene_extent_u / 4),
          static_cast<float>(tolerance_sigmas), registration};
}

Inquiry::Inquiry(const Reconstruction& judged, const Sim3& t2_from_judged,
                 const DepthCorrection& correction, const Witness& witness,
                 std::vector<std::vector<int>> views, float min_confidence)
    : judged_(judged),
      t2_from_judged_(t2_from_judged),
      correction_(correction),
      witness_(witness),
      views_(std::move(views)),
      min_confidence_(min_confidence),
      pairs_(views_.size()) {
  for (size_t i = 0; i < views_.size(); ++i) {
    for (const int j : views_[i]) {
      const Rigid3& pose = witness.camera_from_t2[static_cast<size_t>(j)];
      pairs_[i].emplace_back(PairAlignment{pose.rotation, pose.translation, 0, 0},
                             witness.epoch->views[static_cast<size_t>(j)].pinhole, 0);
    }
  }
}

void Inquiry::sample_gaps(std::vector<float>& gaps) const {
  for (int frame = 0; frame < judged_.num_frames(); ++frame) {
    for_each_point(frame, kSigmaStride, [&](size_t, const Eigen::Vector3f& x) {
      for_each_witness(frame, x, 0, [&](size_t, const Testimony& said) {
        if (said.far > 0) gaps.push_back((0.5f * (said.near + said.far) - said.z) / said.z);
      });
    });
  }
}

void Inquiry::set_sigma(double sigma) {
  for (auto& pairs : pairs_) {
    for (PairProjection& pair : pairs) pair.sigma = static_cast<float>(sigma);
  }
}

void Inquiry::align_pairs(double gate, double scene_extent_u, double max_sigma) {
  parallel_for(judged_.num_frames(), 1, [&](int64_t frame, int64_t) {
    const size_t i = static_cast<size_t>(frame);
    std::vector<Eigen::Vector3f> points;
    for_each_point(static_cast<int>(frame), std::max(1, judged_.width / kAlignmentPointsAcross),
                   [&](size_t, const Eigen::Vector3f& x) { points.push_back(x); });
    for (size_t k = 0; k < views_[i].size(); ++k) {
      const size_t j = static_cast<size_t>(views_[i][k]);
      const WitnessPhoto photo{witness_.camera_from_t2[j], witness_.epoch->views[j].pinhole,
                               witness_.windows(j)};
      const PairAlignment pair = align_pair(points, photo, gate, scene_extent_u, {});
      const double sigma = std::max(kMinGapSigma, pair.gap_sigma);
      pairs_[i][k] = PairProjection(pair, photo.pinhole, sigma > max_sigma ? 0 : sigma);
    }
  });
}

void Inquiry::add_sigmas(std::vector<float>& sigmas) const {
  for (const auto& pairs : pairs_) {
    for (const PairProjection& pair : pairs) sigmas.push_back(pair.sigma);
  }
}

std::unique_ptr<VoteGrid> Inquiry::vote(const VoteScale& scale, double voxel_size) const {
  for (;; voxel_size *= 2) {
    auto grid = std::make_unique<VoteGrid>(voxel_size);
    std::atomic<bool> fits{true};
    parallel_for(judged_.num_frames(), 1, [&](int64_t frame, int64_t) {
      for_each_point(static_cast<int>(frame), 1, [&](size_t, const Eigen::Vector3f& x) {
        if (!fits.load(std::memory_order_relaxed)) return;
        PointVotes votes;
        for_each_witness(static_cast<int>(frame), x, scale.tolerance_sigmas,
                         [&](size_t, const Testimony& said) { votes.cast(said, scale); });
        if (!grid->add(x, votes.rounded(scale))) fits.store(false);
      });
    });
    if (fits) return grid;
  }
}

}  // namespace vggtcd
