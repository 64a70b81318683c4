// SPDX-License-Identifier: Apache-2.0
// Coarse registration through the joint pass over keyframes (section 3.2 of the paper).
#include "vggtcd/registration/coarse.h"

#include <algorithm>
#include <span>
#include <vector>

#include "vggtcd/core/splitmix64.h"
#include "vggtcd/geometry/order_statistics.h"
#include "vggtcd/geometry/umeyama.h"
#include "vggtcd/scene/confidence.h"
#include "vggtcd/scene/point_cloud.h"

namespace vggtcd {
namespace {

// A pixel in the epoch and the same pixel in the joint pass, as indices into their [S, H, W].
struct PixelPair {
  uint32_t in_epoch;
  uint32_t in_joint;
};

// Selection sampling: every subset of `count` elements is equally likely, the order stays.
std::vector<PixelPair> subsample(const std::vector<PixelPair>& all, size_t count, uint64_t seed) {
  if (all.size() <= count) return all;
  std::vector<PixelPair> chosen;
  chosen.reserve(count);
  uint64_t state = seed;
  for (size_t i = 0; chosen.size() < count; ++i, state += kSplitMix64Step) {
    const double uniform = unit_interval(splitmix64(state));
    const size_t left = all.size() - i;
    if (uniform * static_cast<double>(left) < static_cast<double>(count - chosen.size())) {
      chosen.push_back(all[i]);
    }
  }
  return chosen;
}

std::vector<PixelPair> confident_pairs(const Reconstruction& epoch, const Reconstruction& joint,
                                       const std::vector<int>& keyframes, int first_joint_frame) {
  const float min_confidence = confidence_threshold(epoch);
  const size_t per_frame = epoch.pixels_per_frame();
  std::vector<PixelPair> pairs;
  for (size_t k = 0; k < keyframes.size(); ++k) {
    const size_t epoch_begin = static_cast<size_t>(keyframes[k]) * per_frame;
    const size_t joint_begin = (static_cast<size_t>(first_joint_frame) + k) * per_frame;
    for (size_t i = 0; i < per_frame; ++i) {
      if (epoch.depth[epoch_begin + i] > 0 && joint.depth[joint_begin + i] > 0 &&
          epoch.confidence[epoch_begin + i] > min_confidence) {
        pairs.push_back(
            {static_cast<uint32_t>(epoch_begin + i), static_cast<uint32_t>(joint_begin + i)});
      }
    }
  }
  return pairs;
}

// Takes out pairs that show two surfaces: their depths in the two passes differ by more than a
// factor of three from what the passes' scales make of them. A least-squares fit would follow a
// single one of them wherever it lies. Where more than one in a hundred is like that, it is no
// stray: the passes do not fit together, and the fit will show it.
void drop_stray_pairs(const Reconstruction& epoch, const Reconstruction& joint,
                      std::vector<PixelPair>& pairs) {
  constexpr double kOtherSurface = 3;
  constexpr size_t kOneIn = 100;
  if (pairs.empty()) return;
  const auto ratio = [&](const PixelPair& pair) {
    return static_cast<double>(joint.depth[pair.in_joint]) /
           static_cast<double>(epoch.depth[pair.in_epoch]);
  };
  std::vector<double> ratios;
  for (const PixelPair& pair : pairs) ratios.push_back(ratio(pair));
  const double common = middle_of(std::move(ratios));
  const auto is_stray = [&](const PixelPair& pair) {
    const double off = ratio(pair) / common;
    return off > kOtherSurface || off < 1 / kOtherSurface;
  };
  const auto strays = static_cast<size_t>(std::ranges::count_if(pairs, is_stray));
  if (strays * kOneIn <= pairs.size()) std::erase_if(pairs, is_stray);
}

// The mean squared distance from the mean.
double variance(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& x : points) mean += x;
  mean /= static_cast<double>(points.size());
  double sum = 0;
  for (const Eigen::Vector3d& x : points) sum += (x - mean).squaredNorm();
  return sum / static_cast<double>(points.size());
}

}  // namespace

void CoarseOptions::validate() const {
  check_field(max_correspondences >= 3, "max_correspondences", max_correspondences, "at least 3");
}

EpochToJoint align_epoch_to_joint(const Reconstruction& epoch, const Reconstruction& joint,
                                  const std::vector<int>& keyframes, int first_joint_frame,
                                  const char* epoch_name, const CoarseOptions& options,
                                  PairWeights pair_weights) {
  options.validate();
  if (epoch.width != joint.width || epoch.height != joint.height) {
    throw_error(
        ErrorCode::kInput,
        "joint pass: expected frames of {} x {} px as in the {} epoch, found {} x {}; make both "
        "passes from the same pre-processed photos",
        epoch.width, epoch.height, epoch_name, joint.width, joint.height);
  }
  for (const int frame : keyframes) {
    check(frame >= 0 && frame < epoch.num_frames(), "align_epoch_to_joint: keyframe in range");
  }
  check(first_joint_frame + static_cast<int>(keyframes.size()) <= joint.num_frames(),
        "align_epoch_to_joint: one joint frame per keyframe");

  const std::vector<PixelPair> candidates =
      confident_pairs(epoch, joint, keyframes, first_joint_frame);
  std::vector<PixelPair> pairs =
      subsample(candidates, static_cast<size_t>(options.max_correspondences), options.seed);
  drop_stray_pairs(epoch, joint, pairs);
  if (pairs.size() < 3) {
    throw_error(ErrorCode::kDegenerate,
                "{} epoch: expected at least 3 confident pixels in its {} keyframes, found {}",
                epoch_name, keyframes.size(), pairs.size());
  }
  std::vector<Eigen::Vector3d> in_epoch, in_joint;
  std::vector<double> weights;
  for (const PixelPair& pair : pairs) {
    in_epoch.push_back(unproject_pixel(epoch, pair.in_epoch).cast<double>());
    in_joint.push_back(unproject_pixel(joint, pair.in_joint).cast<double>());
    const double depth_u = static_cast<double>(epoch.depth[pair.in_epoch]);
    weights.push_back(pair_weights == PairWeights::kEqual ? 1 : 1 / (depth_u * depth_u));
  }
  // Points are float, so a line is 1e-7 of its length thick; paired with a relief that is as wide
  // as long this is the ratio of the singular values. No usable scene is anywhere near a thousandth
  // thick.
  const UmeyamaResult fit =
      umeyama(in_epoch, in_joint, weights, {.min_singular_value_ratio = 1e-6});
  if (!fit.determined()) {
    throw_error(
        ErrorCode::kDegenerate,
        "{} epoch: its confident points do not determine a similarity to the joint pass ({})",
        epoch_name, describe(fit.status));
  }

  EpochToJoint result;
  result.joint_from_epoch = fit.y_from_x;
  result.candidates = static_cast<int64_t>(candidates.size());
  result.correspondences = static_cast<int64_t>(pairs.size());
  result.rms_residual_u = fit.rms;
  result.unexplained_share = fit.rms * fit.rms / variance(in_joint);
  for (Eigen::Vector3d& x : in_epoch) x = fit.y_from_x * x;
  // Pairs are in the order of the keyframes.
  for (size_t begin = 0, end = 0; begin < pairs.size(); begin = end) {
    const size_t frame = pairs[begin].in_joint / joint.pixels_per_frame();
    while (end < pairs.size() && pairs[end].in_joint / joint.pixels_per_frame() == frame) ++end;
    const size_t count = end - begin;
    result.keyframes.push_back(keyframe_witness(std::span(in_epoch).subspan(begin, count),
                                                std::span(in_joint).subspan(begin, count),
                                                std::span(weights).subspan(begin, count)));
  }
  return result;
}

Sim3 compose_through_joint(const Sim3& joint_from_t1, const Sim3& joint_from_t2) {
  const double scale = joint_from_t1.scale / joint_from_t2.scale;
  const Eigen::Matrix3d rotation = joint_from_t2.rotation.transpose() * joint_from_t1.rotation;
  const Eigen::Vector3d translation = joint_from_t2.rotation.transpose() *
                                      (joint_from_t1.translation - joint_from_t2.translation) /
                                      joint_from_t2.scale;
  return {scale, rotation, translation};
}

InitialUncertainty coarse_uncertainty(const CoarseResult& coarse) {
  return coarse_uncertainty(coarse.t1.keyframes, coarse.t2.keyframes, coarse.t2.joint_from_epoch);
}

CoarseResult align_coarse(const Reconstruction& before, const Reconstruction& after,
                          const JointReconstruction& joint, const CoarseOptions& options,
                          PairWeights weights) {
  CoarseResult result;
  result.t1 = align_epoch_to_joint(before, joint.reconstruction, joint.keyframes_t1, 0, "before",
                                   options, weights);
  result.t2 =
      align_epoch_to_joint(after, joint.reconstruction, joint.keyframes_t2,
                           static_cast<int>(joint.keyframes_t1.size()), "after", options, weights);
  result.t2_from_t1 = compose_through_joint(result.t1.joint_from_epoch, result.t2.joint_from_epoch);
  return result;
}

}  // namespace vggtcd
