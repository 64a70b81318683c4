// SPDX-License-Identifier: Apache-2.0
// Change by free-space reasoning: votes of the other epoch's photos, fused over voxels.
#include "vggtcd/change/free_space.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>

#include "vggtcd/change/view_overlap.h"
#include "vggtcd/change/vote_grid.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/geometry/order_statistics.h"
#include "vggtcd/geometry/robust_extent.h"
#include "vggtcd/scene/confidence.h"
#include "vggtcd/scene/point_cloud.h"

namespace vggtcd {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr double kSigmaFromMad = 1.4826;
constexpr double kMinGapSigma = 1e-3;  // of the depth: no network measures depth better
constexpr double kGapSteps = 1 << 16;  // fixed-point steps of a gap, per scene extent
constexpr int kSigmaStride = 5;        // every 5th row and column is looked at for the scene's gaps

// An epoch with everything that a point of the other one is held against, in the common frame T2.
struct Witness {
  const Reconstruction* epoch = nullptr;
  std::vector<Rigid3> camera_from_t2;  // depths in T2 units
  double depth_scale = 1;              // T2 units per unit of the epoch
  std::vector<float> near,
      far;  // [S, H, W] T2 units: extremes of the 3 x 3 window; far 0: no testimony
};

float confidence_rank(const Reconstruction& r, double share) {
  std::vector<float> values;
  values.reserve(r.num_pixels());
  for (size_t i = 0; i < r.num_pixels(); ++i) {
    if (r.depth[i] > 0) values.push_back(r.confidence[i]);
  }
  if (values.empty())
    throw_error(ErrorCode::kDegenerate, "no pixel of any of the {} frames has depth",
                r.num_frames());
  const double percents[] = {100 * share};
  return static_cast<float>(percentiles(values, percents)[0]);
}

// A pixel may testify, and be judged, if it has depth and is not among the least confident.
bool testifies(const Reconstruction& r, size_t pixel, float min_confidence) {
  return r.depth[pixel] > 0 && r.confidence[pixel] >= min_confidence;
}

Witness make_witness(const Reconstruction& epoch, const Sim3& t2_from_epoch, float min_confidence) {
  Witness witness;
  witness.epoch = &epoch;
  witness.depth_scale = t2_from_epoch.scale;
  for (const View& view : epoch.views) {
    witness.camera_from_t2.push_back(camera_from_new_world(view.camera_from_world, t2_from_epoch));
  }
  witness.near.resize(epoch.num_pixels());
  witness.far.resize(epoch.num_pixels());
  const int height = epoch.height, width = epoch.width;
  parallel_for(epoch.num_frames(), 1, [&](int64_t frame, int64_t) {
    const size_t first = static_cast<size_t>(frame) * epoch.pixels_per_frame();
    for (int v = 0; v < height; ++v) {
      for (int u = 0; u < width; ++u) {
        float lo = std::numeric_limits<float>::max(), hi = 0;
        for (int y = std::max(0, v - 1); y <= std::min(height - 1, v + 1); ++y) {
          for (int x = std::max(0, u - 1); x <= std::min(width - 1, u + 1); ++x) {
            const size_t i = first + static_cast<size_t>(y) * static_cast<size_t>(width) +
                             static_cast<size_t>(x);
            if (!testifies(epoch, i, min_confidence)) continue;
            lo = std::min(lo, epoch.depth[i]);
            hi = std::max(hi, epoch.depth[i]);
          }
        }
        const size_t i =
            first + static_cast<size_t>(v) * static_cast<size_t>(width) + static_cast<size_t>(u);
        const float scale = static_cast<float>(witness.depth_scale);
        witness.near[i] = lo * scale;
        witness.far[i] = hi * scale;
      }
    }
  });
  return witness;
}

// The projection of a view as floats, for the inner loop.
struct Projection {
  Eigen::Matrix3f matrix;
  Eigen::Vector3f offset;
  int width, height;

  Projection(const Rigid3& camera_from_t2, const Pinhole& pinhole)
      : matrix((pinhole.matrix() * camera_from_t2.rotation).cast<float>()),
        offset((pinhole.matrix() * camera_from_t2.translation).cast<float>()),
        width(pinhole.width),
        height(pinhole.height) {}

  // The pixel index within the frame and the depth; false if the point is outside the photo.
  bool operator()(const Eigen::Vector3f& x, size_t& pixel, float& depth) const {
    const Eigen::Vector3f h = matrix * x + offset;
    depth = h.z();
    if (!(depth > 0)) return false;
    const float u = h.x() / depth + 0.5f, v = h.y() / depth + 0.5f;
    if (!(u >= 0 && v >= 0 && u < static_cast<float>(width) && v < static_cast<float>(height)))
      return false;
    pixel = static_cast<size_t>(v) * static_cast<size_t>(width) + static_cast<size_t>(u);
    return true;
  }
};

// One direction: the points of `judged` (in T2) before the photos of the witness.
class Direction {
 public:
  Direction(const Reconstruction& judged, const Sim3& t2_from_judged, const Witness& witness,
            std::vector<std::vector<int>> views, float min_confidence)
      : judged_(judged),
        t2_from_judged_(t2_from_judged),
        witness_(witness),
        views_(std::move(views)),
        min_confidence_(min_confidence) {
    for (size_t j = 0; j < witness.camera_from_t2.size(); ++j) {
      projections_.emplace_back(witness.camera_from_t2[j], witness.epoch->views[j].pinhole);
    }
  }

  // Relative gaps (window centre - z) / z of a sparse sample: how well unchanged surfaces agree.
  void sample_gaps(std::vector<float>& gaps) const {
    for (int frame = 0; frame < judged_.num_frames(); ++frame) {
      for_each_point(frame, kSigmaStride, [&](size_t, const Eigen::Vector3f& x) {
        for (const int j : views_[static_cast<size_t>(frame)]) {
          size_t pixel = 0;
          float z = 0;
          if (!projections_[static_cast<size_t>(j)](x, pixel, z)) continue;
          pixel += static_cast<size_t>(j) * witness_.epoch->pixels_per_frame();
          if (witness_.far[pixel] <= 0) continue;
          gaps.push_back((0.5f * (witness_.near[pixel] + witness_.far[pixel]) - z) / z);
        }
      });
    }
  }

  // Votes of every point, fused over voxels. Grows the voxels if there are too many.
  std::unique_ptr<VoteGrid> vote(float tolerance, double voxel_size, double gap_unit) const {
    for (;; voxel_size *= 2) {
      auto grid = std::make_unique<VoteGrid>(voxel_size);
      std::atomic<bool> fits{true};
      parallel_for(judged_.num_frames(), 1, [&](int64_t frame, int64_t) {
        for_each_point(static_cast<int>(frame), 1, [&](size_t, const Eigen::Vector3f& x) {
          if (!fits.load(std::memory_order_relaxed)) return;
          uint32_t votes = 0, through = 0;
          int64_t gap_sum = 0;
          for (const int j : views_[static_cast<size_t>(frame)]) {
            size_t pixel = 0;
            float z = 0;
            if (!projections_[static_cast<size_t>(j)](x, pixel, z)) continue;
            pixel += static_cast<size_t>(j) * witness_.epoch->pixels_per_frame();
            const float near = witness_.near[pixel], far = witness_.far[pixel];
            if (far <= 0 || z - far > tolerance * z) continue;  // says nothing, or hidden
            const float gap = z < near ? near - z : (z > far ? far - z : 0.0f);
            ++votes;
            if (gap > tolerance * z) ++through;
            gap_sum += static_cast<int64_t>(std::lround(static_cast<double>(gap) / gap_unit));
          }
          if (votes > 0 && !grid->add(x, votes, through, gap_sum)) fits.store(false);
        });
      });
      if (fits) return grid;
    }
  }

  // Reads the fused votes back into the photos.
  EpochFreeSpace labels(const VoteGrid& grid, ChangeLabel changed, double gap_unit,
                        const FreeSpaceOptions& options) const {
    EpochFreeSpace result;
    result.label.assign(judged_.num_pixels(), ChangeLabel::kNoEvidence);
    result.gap.assign(judged_.num_pixels(), kNaN);
    result.votes.assign(judged_.num_pixels(), 0.0f);
    result.through_share.assign(judged_.num_pixels(), kNaN);
    parallel_for(judged_.num_frames(), 1, [&](int64_t frame, int64_t) {
      for_each_point(static_cast<int>(frame), 1, [&](size_t pixel, const Eigen::Vector3f& x) {
        const Votes fused = grid.at(x);
        const double votes = fused.points > 0 ? static_cast<double>(fused.votes) / fused.points : 0;
        result.votes[pixel] = static_cast<float>(votes);
        result.label[pixel] = ChangeLabel::kUnobserved;
        if (votes < options.min_votes) return;
        const double through = static_cast<double>(fused.through) / fused.votes;
        result.through_share[pixel] = static_cast<float>(through);
        result.gap[pixel] =
            static_cast<float>(gap_unit * static_cast<double>(fused.gap_sum) / fused.votes);
        result.label[pixel] =
            through >= options.min_through_share ? changed : ChangeLabel::kUnchanged;
      });
    });
    return result;
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

  const Reconstruction& judged_;
  Sim3 t2_from_judged_;
  const Witness& witness_;
  std::vector<std::vector<int>> views_;
  float min_confidence_;
  std::vector<Projection> projections_;
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

double extent_of(const Reconstruction& after) {
  return robust_extent(unproject(after, confidence_threshold(after)).positions);
}

}  // namespace

void FreeSpaceOptions::validate() const {
  check_field(max_views >= 1, "max_views", max_views, "at least 1");
  check_field(min_confidence_rank >= 0 && min_confidence_rank < 1, "min_confidence_rank",
              min_confidence_rank, "a number in [0, 1)");
  check_field(tolerance_sigmas > 0, "tolerance_sigmas", tolerance_sigmas, "a positive number");
  check_field(min_through_share > 0 && min_through_share <= 1, "min_through_share",
              min_through_share, "a number in (0, 1]");
  check_field(min_votes > 0, "min_votes", min_votes, "a positive number");
  check_field(fusion_grid >= 1, "fusion_grid", fusion_grid, "at least 1");
  check_field(median_radius_px >= 0, "median_radius_px", median_radius_px, "at least 0");
}

FreeSpaceChange free_space_changes(const Reconstruction& before, const Reconstruction& after,
                                   const Sim3& t2_from_t1, const FreeSpaceOptions& options,
                                   ProgressSink& progress) {
  options.validate();
  ProgressStage stage(progress, "free-space change");
  FreeSpaceChange result;
  result.scene_extent_u = extent_of(after);
  const float min_confidence_t1 = confidence_rank(before, options.min_confidence_rank);
  const float min_confidence_t2 = confidence_rank(after, options.min_confidence_rank);
  const Witness witness_t1 = make_witness(before, t2_from_t1, min_confidence_t1);
  const Witness witness_t2 = make_witness(after, {}, min_confidence_t2);
  stage.advance(0.2);
  const Direction t1(before, t2_from_t1, witness_t2,
                     overlapping_views(before, after, t2_from_t1, options.max_views),
                     min_confidence_t1);
  const Direction t2(after, {}, witness_t1,
                     overlapping_views(after, before, t2_from_t1.inverse(), options.max_views),
                     min_confidence_t2);

  std::vector<float> gaps;
  t1.sample_gaps(gaps);
  t2.sample_gaps(gaps);
  if (!gaps.empty()) {
    for (float& gap : gaps) gap = std::abs(gap);
    result.gap_sigma = kSigmaFromMad * static_cast<double>(median(gaps));
  }
  result.gap_sigma = std::max(result.gap_sigma, kMinGapSigma);
  stage.advance(0.3);

  const float tolerance = static_cast<float>(options.tolerance_sigmas * result.gap_sigma);
  const double voxel_size = result.scene_extent_u / options.fusion_grid;
  const double gap_unit = result.scene_extent_u / kGapSteps;
  result.t1 = t1.labels(*t1.vote(tolerance, voxel_size, gap_unit), ChangeLabel::kRemoved, gap_unit,
                        options);
  stage.advance(0.6);
  result.t2 =
      t2.labels(*t2.vote(tolerance, voxel_size, gap_unit), ChangeLabel::kAdded, gap_unit, options);
  stage.advance(0.9);
  median_filter(result.t1.label, before, ChangeLabel::kRemoved, options.median_radius_px);
  median_filter(result.t2.label, after, ChangeLabel::kAdded, options.median_radius_px);
  return result;
}

void decide_by_labels(FreeSpaceChange free_space, ChangeSet& changes) {
  const auto decide = [](std::vector<ChangeLabel> label, EpochChange& epoch) {
    check(label.size() == epoch.score.size(), "decide_by_labels: the same photos");
    epoch.changed = 0;
    epoch.unobserved = 0;
    for (size_t i = 0; i < label.size(); ++i) {
      if (std::isnan(epoch.score[i])) label[i] = ChangeLabel::kNoEvidence;
      epoch.changed += is_change(label[i]) ? 1 : 0;
      epoch.unobserved += label[i] == ChangeLabel::kUnobserved ? 1 : 0;
    }
    epoch.label = std::move(label);
  };
  decide(std::move(free_space.t1.label), changes.t1);
  decide(std::move(free_space.t2.label), changes.t2);
}

}  // namespace vggtcd
