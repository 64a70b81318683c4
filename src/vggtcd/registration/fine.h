// SPDX-License-Identifier: Apache-2.0
// Fine registration: decoupled translation refinement (section 3.3 and Algorithm 1 of the paper).
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "vggtcd/core/options.h"
#include "vggtcd/geometry/sim3.h"
#include "vggtcd/scene/point_cloud.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

struct FineOptions {
  int grid_resolution = 200;   // G of the paper: voxel size = extent / G; >= 1
  double static_factor = 3.0;  // alpha of Eq. 5; > 0
  int64_t min_static = 100;    // fewer static points than this keep the coarse translation; >= 1

  static constexpr auto fields = [](auto&& self, auto&& field) {
    field("grid_resolution", self.grid_resolution,
          "Fine: voxels along the largest axis of the cloud (the paper's G).");
    field("static_factor", self.static_factor,
          "Fine: static are points closer than this many medians (the paper's alpha).");
    field("min_static", self.min_static,
          "Fine: with fewer static points the coarse translation is kept.");
  };
  void validate() const;
};

enum class FineVerdict {
  kRefined,             // the translation moved and the median residual fell
  kKeptCoarseResidual,  // the self-check reverted: the median residual did not fall
  kKeptCoarseFewStatic  // too few static points to refine on
};
std::span<const EnumName<FineVerdict>> enum_names(FineVerdict);

struct FineResult {
  Sim3 t2_from_t1;  // scale and rotation are the coarse ones
  FineVerdict verdict = FineVerdict::kKeptCoarseFewStatic;
  std::string explanation;                          // the verdict in one sentence with its numbers
  double voxel_size_t1_u = 0, voxel_size_t2_u = 0;  // each in its own epoch's units
  int64_t points_t1 = 0, points_t2 = 0;             // after the voxel grid
  int64_t static_points = 0;
  double median_residual_coarse_u = 0;           // over all voxel points, T2 units
  std::optional<double> median_residual_fine_u;  // absent if nothing was refined
  Eigen::Vector3d translation_update_u = Eigen::Vector3d::Zero();  // t* - t, whatever was chosen
};

// Confidence-weighted voxel downsampling: points above the median confidence, voxel size
// robust_extent / grid_resolution, and of each voxel the most confident point.
struct DownsampledCloud {
  std::vector<Eigen::Vector3f> positions;
  double voxel_size_u = 0;
};
DownsampledCloud downsample_confident(const Reconstruction& reconstruction, int grid_resolution);

// Eq. 5: the points with d < static_factor * median(d).
std::vector<uint32_t> static_set(std::span<const float> distances, double static_factor);

// Eq. 6: t* = mean over the static set of p'_nn(i) - s R p_i.
Eigen::Vector3d refined_translation(std::span<const Eigen::Vector3f> points_t1,
                                    std::span<const Eigen::Vector3f> points_t2,
                                    std::span<const int32_t> nearest_in_t2,
                                    std::span<const uint32_t> static_points,
                                    const Sim3& t2_from_t1);

// Algorithm 1 on downsampled clouds. The self-check (Eq. 7) guarantees that the median residual
// does not grow; it does not guarantee anything about the trajectory error (docs/numerics.md).
FineResult refine_translation(const DownsampledCloud& t1, const DownsampledCloud& t2,
                              const Sim3& coarse_t2_from_t1, const FineOptions& options);

// The whole stage from reconstructions.
FineResult align_fine(const Reconstruction& before, const Reconstruction& after,
                      const Sim3& coarse_t2_from_t1, const FineOptions& options);

}  // namespace vggtcd
