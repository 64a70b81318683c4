// SPDX-License-Identifier: Apache-2.0
// Fine registration: decoupled translation refinement (section 3.3 and Algorithm 1 of the paper).
#include "vggtcd/registration/fine.h"

#include "vggtcd/geometry/nearest_neighbors.h"
#include "vggtcd/geometry/order_statistics.h"
#include "vggtcd/geometry/robust_extent.h"
#include "vggtcd/geometry/voxel_grid.h"
#include "vggtcd/registration/map_points.h"
#include "vggtcd/scene/confidence.h"

namespace vggtcd {
std::span<const EnumName<FineVerdict>> enum_names(FineVerdict) {
  static constexpr EnumName<FineVerdict> kNames[] = {
      {FineVerdict::kRefined, "refined"},
      {FineVerdict::kKeptCoarseResidual, "kept_coarse_residual"},
      {FineVerdict::kKeptCoarseFewStatic, "kept_coarse_few_static"}};
  return kNames;
}

void FineOptions::validate() const {
  check_field(grid_resolution >= 1, "grid_resolution", grid_resolution, "at least 1");
  check_field(static_factor > 0, "static_factor", static_factor, "a positive number");
  check_field(min_static >= 1, "min_static", min_static, "at least 1");
}

DownsampledCloud downsample_confident(const Reconstruction& reconstruction, int grid_resolution) {
  const PointCloud cloud = unproject(reconstruction, confidence_threshold(reconstruction));
  DownsampledCloud result;
  result.voxel_size_u = robust_extent(cloud.positions) / grid_resolution;
  for (const uint32_t i :
       voxel_downsample(cloud.positions, cloud.confidence, result.voxel_size_u)) {
    result.positions.push_back(cloud.positions[i]);
  }
  return result;
}

std::vector<uint32_t> static_set(std::span<const float> distances, double static_factor) {
  std::vector<uint32_t> members;
  if (distances.empty()) return members;
  const double limit = static_factor * median(distances);
  for (size_t i = 0; i < distances.size(); ++i) {
    if (distances[i] < limit) members.push_back(static_cast<uint32_t>(i));
  }
  return members;
}

Eigen::Vector3d refined_translation(std::span<const Eigen::Vector3f> points_t1,
                                    std::span<const Eigen::Vector3f> points_t2,
                                    std::span<const int32_t> nearest_in_t2,
                                    std::span<const uint32_t> static_points,
                                    const Sim3& t2_from_t1) {
  check(!static_points.empty(), "refined_translation: a static set");
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const uint32_t i : static_points) {
    const Eigen::Vector3d nearest = points_t2[static_cast<size_t>(nearest_in_t2[i])].cast<double>();
    sum += nearest - t2_from_t1.scale * (t2_from_t1.rotation * points_t1[i].cast<double>());
  }
  return sum / static_cast<double>(static_points.size());
}

FineResult refine_translation(const DownsampledCloud& t1, const DownsampledCloud& t2,
                              const Sim3& coarse_t2_from_t1, const FineOptions& options) {
  options.validate();
  FineResult result;
  result.t2_from_t1 = coarse_t2_from_t1;
  result.voxel_size_t1_u = t1.voxel_size_u;
  result.voxel_size_t2_u = t2.voxel_size_u;
  result.points_t1 = static_cast<int64_t>(t1.positions.size());
  result.points_t2 = static_cast<int64_t>(t2.positions.size());

  // 1. Coarse alignment and distances.
  const NearestNeighborIndex index_t2(t2.positions);
  const NearestNeighbors coarse = index_t2.query(map_points(coarse_t2_from_t1, t1.positions));
  result.median_residual_coarse_u = median(coarse.distance);

  // 2. Static set.
  const std::vector<uint32_t> members = static_set(coarse.distance, options.static_factor);
  result.static_points = static_cast<int64_t>(members.size());
  if (result.static_points < options.min_static) {
    result.verdict = FineVerdict::kKeptCoarseFewStatic;
    result.explanation = fmt::format(
        "Kept the coarse translation: {} static points are fewer than the {} that a refinement "
        "needs.",
        result.static_points, options.min_static);
    return result;
  }

  // 3. Refined translation.
  Sim3 refined = coarse_t2_from_t1;
  refined.translation =
      refined_translation(t1.positions, t2.positions, coarse.index, members, coarse_t2_from_t1);
  result.translation_update_u = refined.translation - coarse_t2_from_t1.translation;

  // 4. Residual self-check over all points, not just the static ones.
  std::vector<float> fine_distance(t1.positions.size());
  index_t2.query(map_points(refined, t1.positions), NearestNeighborIndex::kNoBound, fine_distance);
  const double median_fine = median(fine_distance);
  result.median_residual_fine_u = median_fine;
  const bool improved = median_fine < result.median_residual_coarse_u;
  if (improved) {
    result.verdict = FineVerdict::kRefined;
    result.t2_from_t1 = refined;
    result.explanation = fmt::format(
        "Refined the translation on {} static points: the median residual fell from {:.4g} to "
        "{:.4g}.",
        result.static_points, result.median_residual_coarse_u, median_fine);
  } else {
    result.verdict = FineVerdict::kKeptCoarseResidual;
    result.explanation = fmt::format(
        "Kept the coarse translation: refining on {} static points would not lower the median "
        "residual "
        "({:.4g} before, {:.4g} after).",
        result.static_points, result.median_residual_coarse_u, median_fine);
  }
  return result;
}

FineResult align_fine(const Reconstruction& before, const Reconstruction& after,
                      const Sim3& coarse_t2_from_t1, const FineOptions& options) {
  options.validate();
  const DownsampledCloud t1 = downsample_confident(before, options.grid_resolution);
  const DownsampledCloud t2 = downsample_confident(after, options.grid_resolution);
  return refine_translation(t1, t2, coarse_t2_from_t1, options);
}

}  // namespace vggtcd
