// SPDX-License-Identifier: Apache-2.0
// Change by free-space reasoning: votes of the other epoch's photos, fused over voxels.
#include "vggtcd/change/free_space.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>

#include "vggtcd/change/pair_alignment.h"
#include "vggtcd/change/view_overlap.h"
#include "vggtcd/change/vote_grid.h"
#include "vggtcd/change/witness.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/geometry/order_statistics.h"
#include "vggtcd/geometry/robust_extent.h"
#include "vggtcd/scene/confidence.h"
#include "vggtcd/scene/point_cloud.h"

namespace vggtcd {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr double kSigmaFromMad = 1.4826;
constexpr double kMinGapSigma = 3e-3;       // of the depth: no network measures depth better
constexpr double kMaxGate = 0.12;           // relative gaps beyond it are change, not misalignment
constexpr double kGateSigmas = 5;           // of the gaps before the pairs are aligned
constexpr int kAlignmentPointsAcross = 60;  // points of a photo that align it, along its width
constexpr float kMaxEvidence = 8;           // sigmas; a vote can say no more
constexpr float kEvidenceSteps = 256;       // fixed-point steps of a sigma
constexpr double kUnitWeight = 16;          // of a vote over a quarter of the scene extent
constexpr int kMaxWeight = 256;
constexpr float kSameSurface = 0.03f;  // relative depth step within a surface around a pixel
constexpr int kSmoothReference = 260;  // width that smooth_radius is in pixels of
constexpr double kGapSteps = 1 << 16;  // fixed-point steps of a gap, per scene extent
constexpr size_t kDepthStride = 97;    // every 97th pixel is looked at for the median depth
constexpr int kSigmaStride = 5;        // every 5th row and column is looked at for the scene's gaps

// What the sums are measured in, and the tolerance.
struct Scale {
  double gap_unit = 1;       // T2 units of a step
  float weight_steps_u = 1;  // weight of a vote times its depth, T2 units
  float tolerance_sigmas = 4;
  double registration_sigma_u = 0;
};

// The weight of a vote from this depth, in steps.
int weight_of(float z, const Scale& scale) {
  return std::clamp(static_cast<int>(scale.weight_steps_u / z + 0.5f), 1, kMaxWeight);
}

// The votes of one point, in T2 units; `weight` is in whole steps, so the sums of many points are
// exact whatever their order.
struct PointVotes {
  uint32_t count = 0;
  int weight = 0, through = 0;
  float gap = 0, evidence = 0, sigma = 0;  // weighted

  void cast(const Testimony& said, const Scale& scale) {
    if (said.vote != Vote::kSees && said.vote != Vote::kLooksThrough) return;
    const int steps = weight_of(said.z, scale);
    const float w = static_cast<float>(steps);
    ++count;
    weight += steps;
    if (said.vote == Vote::kLooksThrough) through += steps;
    gap += w * said.gap_u;
    evidence += w * std::clamp(said.gap_u / said.sigma_u, -kMaxEvidence, kMaxEvidence);
    sigma += w * said.sigma_u;
  }
  Votes rounded(const Scale& scale) const {
    return {.points = 1,
            .count = count,
            .weight = weight,
            .through = through,
            .gap = std::llround(static_cast<double>(gap) / scale.gap_unit),
            .evidence = std::llround(evidence * kEvidenceSteps),
            .sigma = std::llround(static_cast<double>(sigma) / scale.gap_unit)};
  }
};

// The votes about a pixel per point that asked, so that every pixel counts the same.
struct Tally {
  float points = 0, count = 0, weight = 0, through = 0, gap = 0, evidence = 0, sigma = 0;

  Tally() = default;
  Tally(const Votes& votes, const Scale& scale) {
    if (votes.points == 0) return;
    const double share = 1.0 / votes.points, unit = share * scale.gap_unit;
    points = 1;
    count = static_cast<float>(share * votes.count);
    weight = static_cast<float>(share * static_cast<double>(votes.weight));
    through = static_cast<float>(share * static_cast<double>(votes.through));
    gap = static_cast<float>(unit * static_cast<double>(votes.gap));
    evidence = static_cast<float>(share * static_cast<double>(votes.evidence) /
                                  static_cast<double>(kEvidenceSteps));
    sigma = static_cast<float>(unit * static_cast<double>(votes.sigma));
  }
  void operator+=(const Tally& other) {
    points += other.points;
    count += other.count;
    weight += other.weight;
    through += other.through;
    gap += other.gap;
    evidence += other.evidence;
    sigma += other.sigma;
  }
};

// Turns the votes about a pixel into its answer.
void answer(const Tally& tally, ChangeLabel changed, const Scale& scale,
            const FreeSpaceOptions& options, size_t pixel, EpochFreeSpace& result) {
  const double photos = static_cast<double>(tally.count / tally.points);
  result.label[pixel] = ChangeLabel::kUnobserved;
  if (photos < options.min_votes || !(tally.weight > 0)) return;
  const double through = static_cast<double>(tally.through / tally.weight);
  const bool is_changed = through >= options.min_through_share;
  result.label[pixel] = is_changed ? changed : ChangeLabel::kUnchanged;
  result.gap[pixel] = tally.gap / tally.weight;
  result.evidence[pixel] = tally.evidence / tally.weight;
  // Agresti and Coull: two votes of either side added, so that unanimity of a few is not certainty.
  const double share = (photos * through + 2) / (photos + 4);
  const double deviation = std::sqrt(share * (1 - share) / (photos + 4));
  const double side = (is_changed ? 1 : -1) * (through - options.min_through_share) / deviation;
  result.confidence[pixel] = static_cast<float>(0.5 * std::erfc(-side / std::sqrt(2.0)));
  const double sigma = static_cast<double>(tally.sigma / tally.weight);
  result.level_of_detection[pixel] =
      static_cast<float>(1.96 * std::sqrt(sigma * sigma / photos +
                                          scale.registration_sigma_u * scale.registration_sigma_u));
}

// One direction: the points of `judged` (in T2) before the photos of the witness.
class Direction {
 public:
  Direction(const Reconstruction& judged, const Sim3& t2_from_judged, const Witness& witness,
            std::vector<std::vector<int>> views, float min_confidence)
      : judged_(judged),
        t2_from_judged_(t2_from_judged),
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

  // Relative gaps (window centre - z) / z of a sparse sample: how well unchanged surfaces agree.
  void sample_gaps(std::vector<float>& gaps) const {
    for (int frame = 0; frame < judged_.num_frames(); ++frame) {
      for_each_point(frame, kSigmaStride, [&](size_t, const Eigen::Vector3f& x) {
        for_each_witness(frame, x, 0, [&](size_t, const Testimony& said) {
          if (said.far > 0) gaps.push_back((0.5f * (said.near + said.far) - said.z) / said.z);
        });
      });
    }
  }

  // Gives every pair its sigma: of all gaps, or its own after aligning it.
  void set_sigma(double sigma) {
    for (auto& pairs : pairs_) {
      for (PairProjection& pair : pairs) pair.sigma = static_cast<float>(sigma);
    }
  }
  void align_pairs(double gate, double scene_extent_u, double max_sigma) {
    const size_t per_frame = witness_.epoch->pixels_per_frame();
    parallel_for(judged_.num_frames(), 1, [&](int64_t frame, int64_t) {
      const size_t i = static_cast<size_t>(frame);
      std::vector<Eigen::Vector3f> points;
      for_each_point(static_cast<int>(frame), std::max(1, judged_.width / kAlignmentPointsAcross),
                     [&](size_t, const Eigen::Vector3f& x) { points.push_back(x); });
      for (size_t k = 0; k < views_[i].size(); ++k) {
        const size_t j = static_cast<size_t>(views_[i][k]);
        const WitnessPhoto photo{witness_.camera_from_t2[j], witness_.epoch->views[j].pinhole,
                                 std::span(witness_.near).subspan(j * per_frame, per_frame),
                                 std::span(witness_.far).subspan(j * per_frame, per_frame)};
        const PairAlignment pair = align_pair(points, photo, gate, scene_extent_u, {});
        const double sigma = std::max(kMinGapSigma, pair.gap_sigma);
        pairs_[i][k] = PairProjection(pair, photo.pinhole, sigma > max_sigma ? 0 : sigma);
      }
    });
  }

  void add_sigmas(std::vector<float>& sigmas) const {
    for (const auto& pairs : pairs_) {
      for (const PairProjection& pair : pairs) sigmas.push_back(pair.sigma);
    }
  }

  // Votes of every point, fused over voxels. Grows the voxels if there are too many.
  std::unique_ptr<VoteGrid> vote(const Scale& scale, double voxel_size) const {
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

  // Reads the fused votes back into the photos.
  EpochFreeSpace labels(const VoteGrid& grid, ChangeLabel changed, const Scale& scale,
                        const FreeSpaceOptions& options) const {
    EpochFreeSpace result;
    result.label.assign(judged_.num_pixels(), ChangeLabel::kNoEvidence);
    for (auto* values :
         {&result.gap, &result.evidence, &result.confidence, &result.level_of_detection}) {
      values->assign(judged_.num_pixels(), kNaN);
    }
    parallel_for(judged_.num_frames(), 1, [&](int64_t frame, int64_t) {
      const size_t first = static_cast<size_t>(frame) * judged_.pixels_per_frame();
      const std::vector<Tally> tallies = tallies_of(static_cast<int>(frame), grid, scale);
      for (int v = 0; v < judged_.height; ++v) {
        for (int u = 0; u < judged_.width; ++u) {
          const size_t pixel = first + index(u, v);
          if (!(judged_.depth[pixel] > 0) || (!options.fill && tallies[index(u, v)].points == 0))
            continue;
          const Tally around = around_pixel(tallies, first, u, v, options.smooth_radius);
          if (around.points > 0) answer(around, changed, scale, options, pixel, result);
        }
      }
    });
    return result;
  }

  // What every photo said about one pixel, and the fused votes; the answer itself is in the labels.
  PixelExplanation explain(const PixelQuestion& question, const VoteGrid& grid, const Scale& scale,
                           const FreeSpaceOptions& options) const {
    const size_t i = static_cast<size_t>(question.frame);
    const size_t first = i * judged_.pixels_per_frame();
    const size_t pixel = first + index(question.x, question.y);
    PixelExplanation why;
    why.question = question;
    why.photo = (question.in_after ? "after/" : "before/") + judged_.views[i].name;
    why.min_through_share = options.min_through_share;
    why.through_share = static_cast<double>(kNaN);
    why.voted = testifies(judged_, pixel, min_confidence_);
    if (!(judged_.depth[pixel] > 0)) return why;
    const PixelRays rays(judged_.views[i], t2_from_judged_);
    const Eigen::Vector3f x = rays.point(question.x, question.y, judged_.depth[pixel]);
    for_each_witness(
        question.frame, x, scale.tolerance_sigmas, [&](size_t k, const Testimony& said) {
          const View& view = witness_.epoch->views[static_cast<size_t>(views_[i][k])];
          PhotoTestimony photo{(question.in_after ? "before/" : "after/") + view.name, -1, -1, said,
                               0};
          if (said.vote != Vote::kOutside) {
            photo.x = static_cast<int>(said.pixel % static_cast<size_t>(view.pinhole.width));
            photo.y = static_cast<int>(said.pixel / static_cast<size_t>(view.pinhole.width));
          }
          PointVotes votes;
          votes.cast(said, scale);
          photo.weight = votes.weight;
          why.photos.push_back(std::move(photo));
        });
    const Tally around = around_pixel(tallies_of(question.frame, grid, scale), first, question.x,
                                      question.y, options.smooth_radius);
    if (around.points > 0) why.votes = static_cast<double>(around.count / around.points);
    if (around.weight > 0) why.through_share = static_cast<double>(around.through / around.weight);
    return why;
  }

 private:
  template <typename Visit>
  void for_each_point(int frame, int stride, Visit&& visit) const {
    const PixelRays rays(judged_.views[static_cast<size_t>(frame)], t2_from_judged_);
    const size_t first = static_cast<size_t>(frame) * judged_.pixels_per_frame();
    for (int v = 0; v < judged_.height; v += stride) {
      for (int u = 0; u < judged_.width; u += stride) {
        const size_t pixel = first + static_cast<size_t>(v) * static_cast<size_t>(judged_.width) +
                             static_cast<size_t>(u);
        if (!testifies(judged_, pixel, min_confidence_)) continue;
        visit(pixel, rays.point(u, v, judged_.depth[pixel]));
      }
    }
  }

  // visit(k, testimony) for each photo that is asked about this frame.
  template <typename Visit>
  void for_each_witness(int frame, const Eigen::Vector3f& x, float tolerance_sigmas,
                        Visit&& visit) const {
    const size_t i = static_cast<size_t>(frame);
    for (size_t k = 0; k < views_[i].size(); ++k) {
      const size_t first = static_cast<size_t>(views_[i][k]) * witness_.epoch->pixels_per_frame();
      visit(k, ask(pairs_[i][k], &witness_.near[first], &witness_.far[first], x, tolerance_sigmas));
    }
  }

  // The fused votes of each pixel of a frame; no points where a pixel may not testify.
  std::vector<Tally> tallies_of(int frame, const VoteGrid& grid, const Scale& scale) const {
    std::vector<Tally> tallies(judged_.pixels_per_frame());
    const size_t first = static_cast<size_t>(frame) * judged_.pixels_per_frame();
    for_each_point(frame, 1, [&](size_t pixel, const Eigen::Vector3f& x) {
      tallies[pixel - first] = Tally(grid.at(x), scale);
    });
    return tallies;
  }

  size_t index(int u, int v) const {
    return static_cast<size_t>(v) * static_cast<size_t>(judged_.width) + static_cast<size_t>(u);
  }

  // The votes of the pixels around that show the same surface.
  Tally around_pixel(const std::vector<Tally>& tallies, size_t first, int u, int v,
                     int radius) const {
    const int step = std::max(1, (judged_.width + kSmoothReference / 2) / kSmoothReference);
    const float depth = judged_.depth[first + index(u, v)];
    Tally sum;
    for (int y = v - radius * step; y <= v + radius * step; y += step) {
      if (y < 0 || y >= judged_.height) continue;
      for (int x = u - radius * step; x <= u + radius * step; x += step) {
        if (x < 0 || x >= judged_.width || tallies[index(x, y)].points == 0) continue;
        if (std::abs(judged_.depth[first + index(x, y)] - depth) > kSameSurface * depth) continue;
        sum += tallies[index(x, y)];
      }
    }
    return sum;
  }

  const Reconstruction& judged_;
  Sim3 t2_from_judged_;
  const Witness& witness_;
  std::vector<std::vector<int>> views_;
  float min_confidence_;
  std::vector<std::vector<PairProjection>> pairs_;  // [frame][k], with views_[frame][k]
};

// The majority of the judged labels (unchanged, changed) in the window; a single pixel is noise.
void median_filter(std::vector<ChangeLabel>& labels, const Reconstruction& r, ChangeLabel changed,
                   int radius) {
  if (radius <= 0) return;
  parallel_for(r.num_frames(), 1, [&](int64_t frame, int64_t) {
    const size_t first = static_cast<size_t>(frame) * r.pixels_per_frame();
    const std::vector<ChangeLabel> before(
        labels.begin() + static_cast<int64_t>(first),
        labels.begin() + static_cast<int64_t>(first + r.pixels_per_frame()));
    const auto index = [&](int x, int y) {
      return static_cast<size_t>(y) * static_cast<size_t>(r.width) + static_cast<size_t>(x);
    };
    for (int v = 0; v < r.height; ++v) {
      for (int u = 0; u < r.width; ++u) {
        const ChangeLabel own = before[index(u, v)];
        if (own != changed && own != ChangeLabel::kUnchanged) continue;
        int for_change = 0, judged = 0;
        for (int y = std::max(0, v - radius); y <= std::min(r.height - 1, v + radius); ++y) {
          for (int x = std::max(0, u - radius); x <= std::min(r.width - 1, u + radius); ++x) {
            const ChangeLabel label = before[index(x, y)];
            for_change += label == changed ? 1 : 0;
            judged += label == changed || label == ChangeLabel::kUnchanged ? 1 : 0;
          }
        }
        if (2 * for_change != judged) {
          labels[first + index(u, v)] = 2 * for_change > judged ? changed : ChangeLabel::kUnchanged;
        }
      }
    }
  });
}

size_t pixel_index(const Reconstruction& r, const PixelQuestion& question) {
  return static_cast<size_t>(question.frame) * r.pixels_per_frame() +
         static_cast<size_t>(question.y) * static_cast<size_t>(r.width) +
         static_cast<size_t>(question.x);
}

double extent_of(const Reconstruction& after) {
  return robust_extent(unproject(after, confidence_threshold(after)).positions);
}

// The robust sigma of the relative gaps of all pairs as they come.
double sigma_of_gaps(const Direction& t1, const Direction& t2) {
  std::vector<float> gaps;
  t1.sample_gaps(gaps);
  t2.sample_gaps(gaps);
  if (gaps.empty()) return 0;
  for (float& gap : gaps) gap = std::abs(gap);
  return kSigmaFromMad * static_cast<double>(median(gaps));
}

double median_sigma(const Direction& t1, const Direction& t2, double otherwise) {
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

}  // namespace

void FreeSpaceOptions::validate() const {
  check_field(max_views >= 1, "max_views", max_views, "at least 1");
  check_field(min_confidence_rank >= 0 && min_confidence_rank < 1, "min_confidence_rank",
              min_confidence_rank, "a number in [0, 1)");
  check_field(tolerance_sigmas > 0, "tolerance_sigmas", tolerance_sigmas, "a positive number");
  check_field(max_pair_sigma > 0, "max_pair_sigma", max_pair_sigma, "a positive number");
  check_field(smooth_radius >= 0, "smooth_radius", smooth_radius, "at least 0");
  check_field(min_through_share > 0 && min_through_share <= 1, "min_through_share",
              min_through_share, "a number in (0, 1]");
  check_field(min_votes > 0, "min_votes", min_votes, "a positive number");
  check_field(fusion_grid >= 1, "fusion_grid", fusion_grid, "at least 1");
  check_field(median_radius_px >= 0, "median_radius_px", median_radius_px, "at least 0");
}

FreeSpaceChange free_space_changes(const Reconstruction& before, const Reconstruction& after,
                                   const Sim3& t2_from_t1, const FreeSpaceOptions& options,
                                   double registration_sigma_u, ProgressSink& progress,
                                   const PixelQuestion* question) {
  options.validate();
  ProgressStage stage(progress, "free-space change");
  FreeSpaceChange result;
  result.scene_extent_u = extent_of(after);
  const float min_confidence_t1 = confidence_percentile(before, 100 * options.min_confidence_rank);
  const float min_confidence_t2 = confidence_percentile(after, 100 * options.min_confidence_rank);
  const Witness witness_t1 = make_witness(before, t2_from_t1, min_confidence_t1);
  const Witness witness_t2 = make_witness(after, {}, min_confidence_t2);
  stage.advance(0.1);
  Direction t1(before, t2_from_t1, witness_t2,
               overlapping_views(before, after, t2_from_t1, options.max_views), min_confidence_t1);
  Direction t2(after, {}, witness_t1,
               overlapping_views(after, before, t2_from_t1.inverse(), options.max_views),
               min_confidence_t2);

  const double scene_sigma = std::max(kMinGapSigma, sigma_of_gaps(t1, t2));
  const double gate = std::min(kMaxGate, kGateSigmas * scene_sigma);
  for (Direction* direction : {&t1, &t2}) {
    direction->set_sigma(scene_sigma);
    if (options.align_pairs) {
      direction->align_pairs(gate, result.scene_extent_u, options.max_pair_sigma);
    }
  }
  result.gap_sigma = median_sigma(t1, t2, scene_sigma);
  result.surface_sigma_u = result.gap_sigma * t2_depth(after);
  stage.advance(0.2);

  const Scale scale{result.scene_extent_u / kGapSteps,
                    static_cast<float>(kUnitWeight * result.scene_extent_u / 4),
                    static_cast<float>(options.tolerance_sigmas), registration_sigma_u};
  const double voxel_size = result.scene_extent_u / options.fusion_grid;
  const auto judge = [&](const Direction& direction, const Reconstruction& epoch,
                         ChangeLabel changed, EpochFreeSpace& judged) {
    const auto grid = direction.vote(scale, voxel_size);
    judged = direction.labels(*grid, changed, scale, options);
    median_filter(judged.label, epoch, changed, options.median_radius_px);
    if (!question || question->in_after != (changed == ChangeLabel::kAdded)) return;
    PixelExplanation why = direction.explain(*question, *grid, scale, options);
    const size_t pixel = pixel_index(epoch, *question);
    why.label = judged.label[pixel];
    why.confidence = judged.confidence[pixel];
    why.gap_u = judged.gap[pixel];
    why.level_of_detection_u = judged.level_of_detection[pixel];
    result.explanation = std::move(why);
  };
  judge(t1, before, ChangeLabel::kRemoved, result.t1);
  stage.advance(0.6);
  judge(t2, after, ChangeLabel::kAdded, result.t2);
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
    epoch.gap = std::move(votes.gap);
    epoch.evidence = std::move(votes.evidence);
    epoch.confidence = std::move(votes.confidence);
    epoch.level_of_detection = std::move(votes.level_of_detection);
  };
  decide(free_space.t1, changes.t1);
  decide(free_space.t2, changes.t2);
}

}  // namespace vggtcd
