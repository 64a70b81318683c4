// SPDX-License-Identifier: Apache-2.0
// PointCloud: the points of a reconstruction as parallel arrays, each point knowing its pixel.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "vggtcd/core/large_array.h"
#include "vggtcd/geometry/point_source.h"
#include "vggtcd/geometry/sim3.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

// All arrays have one entry per point. Positions are in the reconstruction's frame and units.
struct PointCloud {
  LargeArray<Eigen::Vector3f> positions;
  LargeArray<float> confidence;
  LargeArray<uint32_t> pixels;  // index into the reconstruction's [S, H, W]

  size_t size() const { return positions.size(); }
};

// Eq. 1 of the paper for one view: x_out = matrix * depth * (u, v, 1) + offset; camera, world and
// out_from_world in one affine map in double precision.
struct PixelRays {
  Eigen::Matrix3d matrix;
  Eigen::Vector3d offset;

  PixelRays(const View& view, const Sim3& out_from_world);

  Eigen::Vector3f point(int u_px, int v_px, float depth) const {
    return (matrix * (static_cast<double>(depth) * Eigen::Vector3d(u_px, v_px, 1.0)) + offset)
        .cast<float>();
  }
};

// Eq. 1 of the paper: the point of a pixel, R^-1 (D K^-1 u - t), pixel centres at integers;
// out_from_world is applied to it in double precision before rounding.
Eigen::Vector3f unproject_pixel(const Reconstruction& reconstruction, uint32_t pixel,
                                const Sim3& out_from_world = {});

// Whether unproject() makes a point of this pixel: it has depth, and a confidence above the
// threshold.
inline bool is_confident(const Reconstruction& reconstruction, size_t pixel, float min_confidence) {
  return reconstruction.depth[pixel] > 0 && reconstruction.confidence[pixel] > min_confidence;
}

// The points of all pixels with depth > 0 and confidence > min_confidence, in pixel order.
PointCloud unproject(const Reconstruction& reconstruction, float min_confidence,
                     const Sim3& out_from_world = {});

// Their positions alone, made frame by frame when they are asked for. Refers to the reconstruction.
class ConfidentPoints : public PointSource {
 public:
  ConfidentPoints(const Reconstruction& reconstruction, float min_confidence,
                  const Sim3& out_from_world = {});
  std::span<const size_t> starts() const override { return starts_; }
  std::span<const Eigen::Vector3f> chunk(size_t frame,
                                         std::vector<Eigen::Vector3f>& memory) const override;

  // Calls take(number of the point, pixel, position) for the points of a frame.
  template <typename Take>
  void for_each_point(size_t frame, const Take& take) const;

 private:
  bool keep(size_t pixel) const { return is_confident(reconstruction_, pixel, min_confidence_); }

  const Reconstruction& reconstruction_;
  float min_confidence_;
  Sim3 out_from_world_;
  std::vector<size_t> starts_;
};

template <typename Take>
void ConfidentPoints::for_each_point(size_t frame, const Take& take) const {
  const PixelRays rays(reconstruction_.views[frame], out_from_world_);
  size_t pixel = frame * reconstruction_.pixels_per_frame();
  size_t i = starts_[frame];
  for (int v = 0; v < reconstruction_.height; ++v) {
    for (int u = 0; u < reconstruction_.width; ++u, ++pixel) {
      if (keep(pixel)) take(i++, pixel, rays.point(u, v, reconstruction_.depth[pixel]));
    }
  }
}

}  // namespace vggtcd
