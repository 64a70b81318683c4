// SPDX-License-Identifier: Apache-2.0
// Change by free-space reasoning: votes of the other epoch's photos, fused over voxels.
#include "vggtcd/change/free_space.h"

#include <algorithm>
#include <cmath>

#include "vggtcd/change/depth_consensus.h"
#include "vggtcd/change/explain_pixel.h"
#include "vggtcd/change/inquiry.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/geometry/order_statistics.h"
#include "vggtcd/geometry/robust_extent.h"
#include "vggtcd/scene/confidence.h"
#include "vggtcd/scene/point_cloud.h"
#include "vggtcd/scene/view_overlap.h"

namespace vggtcd {
namespace {

constexpr double kSigmaFromMad = 1.4826;
constexpr double kMaxGate = 0.12;    // relative gaps beyond it are change, not misalignment
constexpr double kGateSigmas = 5;    // of the gaps before the pairs are aligned
constexpr size_t kDepthStride = 97;  // every 97th pixel is looked at for the median depth

double extent_of(const Reconstruction& after) {
  return robust_extent(unproject(after, confidence_threshold(after)).positions);
}

// The robust sigma of the relative gaps of all pairs as they come.
double sigma_of_gaps(const Inquiry& t1, const Inquiry& t2) {
  std::vector<float> gaps;
  t1.sample_gaps(gaps);
  t2.sample_gaps(gaps);
  if (gaps.empty()) return 0;
  for (float& gap : gaps) gap = std::abs(gap);
  return kSigmaFromMad * static_cast<double>(median(gaps));
}

double median_sigma(const Inquiry& t1, const Inquiry& t2, double otherwise) {
  std::vector<float> sigmas;
  t1.add_sigmas(sigmas);
  t2.add_sigmas(sigmas);
  std::erase(sigmas, 0.0f);
  return sigmas.empty() ? otherwise : static_cast<double>(median(sigmas));
}

// The median depth of a sample of the after epoch's pixels: T2 units.
double t2_depth(const Reconstruction& after) {
  std::vector<float> depths;
  for (size_t pixel = 0; pixel < after.num_pixels(); pixel += kDepthStride) {
    if (after.depth[pixel] > 0) depths.push_back(after.depth[pixel]);
  }
  return depths.empty() ? 0 : static_cast<double>(median(depths));
}

// The answers about all photos of an epoch, handed over one by one; what is needed later is kept.
EpochFreeSpace answer_epoch(const Inquiry& inquiry, const VoteGrid& grid, ChangeLabel changed,
                            const VoteScale& scale, const FreeSpaceOptions& options,
                            const std::function<void(int, const PhotoAnswers&)>& sink) {
  const Reconstruction& judged = inquiry.judged();
  EpochFreeSpace epoch;
  epoch.label.resize(judged.num_pixels());
  std::vector<std::vector<float>> confidence(judged.views.size()), evidence(judged.views.size());
  parallel_for(judged.num_frames(), 1, [&](int64_t frame, int64_t) {
    const PhotoAnswers answers =
        answer_photo(inquiry, static_cast<int>(frame), grid, changed, scale, options);
    std::ranges::copy(answers.label, epoch.label.begin() + frame * std::ssize(answers.label));
    for (size_t i = 0; i < answers.label.size(); ++i) {
      if (answers.label[i] == changed) {
        confidence[static_cast<size_t>(frame)].push_back(answers.confidence[i]);
        evidence[static_cast<size_t>(frame)].push_back(answers.evidence[i]);
      }
    }
    if (sink) sink(static_cast<int>(frame), answers);
  });
  const auto join = [](const std::vector<std::vector<float>>& frames, std::vector<float>& all) {
    for (const auto& of_frame : frames) all.insert(all.end(), of_frame.begin(), of_frame.end());
  };
  join(confidence, epoch.changed_confidence);
  join(evidence, epoch.changed_evidence);
  return epoch;
}

}  // namespace

FreeSpaceChange free_space_changes(const Reconstruction& before, const Reconstruction& after,
                                   const Sim3& t2_from_t1, const FreeSpaceOptions& options,
                                   const PointVariance& registration, ProgressSink& progress,
                                   const PixelQuestion* question, const PhotoAnswersSink& sink) {
  options.validate();
  ProgressStage stage(progress, "free-space change");
  FreeSpaceChange result;
  result.scene_extent_u = extent_of(after);
  const float min_confidence_t1 = confidence_percentile(before, 100 * options.min_confidence_rank);
  const float min_confidence_t2 = confidence_percentile(after, 100 * options.min_confidence_rank);
  const double open_gap_u = result.scene_extent_u;
  Witness witness_t1 = make_witness(before, t2_from_t1, min_confidence_t1, open_gap_u);
  Witness witness_t2 = make_witness(after, {}, min_confidence_t2, open_gap_u);
  if (options.consensus) {
    witness_t1.correction =
        depth_consensus(witness_t1, t2_from_t1, min_confidence_t1, result.scene_extent_u, {});
    witness_t2.correction =
        depth_consensus(witness_t2, {}, min_confidence_t2, result.scene_extent_u, {});
  }
  stage.advance(0.1);
  Inquiry t1(before, t2_from_t1, witness_t1.correction, witness_t2,
             overlapping_views(before, after, t2_from_t1, options.max_views), min_confidence_t1);
  Inquiry t2(after, {}, witness_t2.correction, witness_t1,
             overlapping_views(after, before, t2_from_t1.inverse(), options.max_views),
             min_confidence_t2);

  const double scene_sigma = std::max(kMinGapSigma, sigma_of_gaps(t1, t2));
  const double gate = std::min(kMaxGate, kGateSigmas * scene_sigma);
  for (Inquiry* inquiry : {&t1, &t2}) {
    inquiry->set_sigma(scene_sigma);
    if (options.align_pairs) {
      inquiry->align_pairs(gate, result.scene_extent_u, options.max_pair_sigma);
    }
  }
  result.gap_sigma = median_sigma(t1, t2, scene_sigma);
  result.surface_sigma_u = result.gap_sigma * t2_depth(after);
  stage.advance(0.2);

  const VoteScale scale = vote_scale(result.scene_extent_u, options.tolerance_sigmas, registration);
  const double voxel_size = result.scene_extent_u / options.fusion_grid;
  const auto judge = [&](const Inquiry& inquiry, ChangeLabel changed,
                         const std::function<void(int, const PhotoAnswers&)>& answers) {
    const auto grid = inquiry.vote(scale, voxel_size);
    if (question && question->in_after == (changed == ChangeLabel::kAdded)) {
      result.explanation = explain_pixel(inquiry, *question, *grid, changed, scale, options);
    }
    return answer_epoch(inquiry, *grid, changed, scale, options, answers);
  };
  result.t1 = judge(t1, ChangeLabel::kRemoved, sink.t1);
  stage.advance(0.6);
  result.t2 = judge(t2, ChangeLabel::kAdded, sink.t2);
  return result;
}

void decide_by_labels(FreeSpaceChange free_space, ChangeSet& changes) {
  changes.surface_sigma_u = free_space.surface_sigma_u;
  const auto decide = [](EpochFreeSpace& votes, EpochChange& epoch) {
    check(votes.label.size() == epoch.score.size(), "decide_by_labels: the same photos");
    epoch.points = epoch.changed = epoch.unobserved = 0;
    for (const ChangeLabel label : votes.label) {
      epoch.points += label != ChangeLabel::kNoEvidence ? 1 : 0;
      epoch.changed += is_change(label) ? 1 : 0;
      epoch.unobserved += label == ChangeLabel::kUnobserved ? 1 : 0;
    }
    epoch.label = std::move(votes.label);
    epoch.changed_confidence = std::move(votes.changed_confidence);
    epoch.changed_evidence = std::move(votes.changed_evidence);
    check(std::ssize(epoch.changed_confidence) == epoch.changed &&
              std::ssize(epoch.changed_evidence) == epoch.changed,
          "a confidence and evidence for every change");
  };
  decide(free_space.t1, changes.t1);
  decide(free_space.t2, changes.t2);
}

}  // namespace vggtcd
