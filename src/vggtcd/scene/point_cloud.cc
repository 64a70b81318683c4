// SPDX-License-Identifier: Apache-2.0
// Depth maps to points (Eq. 1 of the paper).
#include "vggtcd/scene/point_cloud.h"

#include <limits>
#include <numeric>
#include <vector>

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"

namespace vggtcd {
namespace {

// The pixels that become points. Counted per frame, so that every frame knows where its points go:
// the same order on any number of threads.
class ConfidentPixels {
 public:
  ConfidentPixels(const Reconstruction& reconstruction, float min_confidence)
      : reconstruction_(reconstruction),
        min_confidence_(min_confidence),
        first_(reconstruction.views.size() + 1, 0) {
    check(reconstruction.num_pixels() <= std::numeric_limits<uint32_t>::max(),
          "unproject: more than 2^32 pixels");
    parallel_for(reconstruction.num_frames(), 1, [&](int64_t frame, int64_t) {
      const size_t begin = static_cast<size_t>(frame) * reconstruction.pixels_per_frame();
      const size_t end = begin + reconstruction.pixels_per_frame();
      size_t count = 0;
      for (size_t pixel = begin; pixel < end; ++pixel) count += keep(pixel) ? 1 : 0;
      first_[static_cast<size_t>(frame) + 1] = count;
    });
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
  }

  size_t size() const { return first_.back(); }

  // Calls take(number of the point, pixel, position).
  template <typename Take>
  void for_each_point(const Sim3& out_from_world, const Take& take) const {
    parallel_for(reconstruction_.num_frames(), 1, [&](int64_t frame, int64_t) {
      const PixelRays rays(reconstruction_.views[static_cast<size_t>(frame)], out_from_world);
      size_t pixel = static_cast<size_t>(frame) * reconstruction_.pixels_per_frame();
      size_t i = first_[static_cast<size_t>(frame)];
      for (int v = 0; v < reconstruction_.height; ++v) {
        for (int u = 0; u < reconstruction_.width; ++u, ++pixel) {
          if (keep(pixel)) take(i++, pixel, rays.point(u, v, reconstruction_.depth[pixel]));
        }
      }
    });
  }

 private:
  bool keep(size_t pixel) const { return is_confident(reconstruction_, pixel, min_confidence_); }

  const Reconstruction& reconstruction_;
  float min_confidence_;
  std::vector<size_t> first_;  // of each frame, and the end
};

}  // namespace

PixelRays::PixelRays(const View& view, const Sim3& out_from_world) {
  const Rigid3 world_from_camera = view.camera_from_world.inverse();
  Eigen::Matrix3d camera_from_pixel = Eigen::Matrix3d::Zero();
  camera_from_pixel(0, 0) = 1.0 / view.pinhole.fx;
  camera_from_pixel(0, 2) = -view.pinhole.cx / view.pinhole.fx;
  camera_from_pixel(1, 1) = 1.0 / view.pinhole.fy;
  camera_from_pixel(1, 2) = -view.pinhole.cy / view.pinhole.fy;
  camera_from_pixel(2, 2) = 1.0;
  matrix = out_from_world.scale * out_from_world.rotation * world_from_camera.rotation *
           camera_from_pixel;
  offset = out_from_world * world_from_camera.translation;
}

Eigen::Vector3f unproject_pixel(const Reconstruction& reconstruction, uint32_t pixel,
                                const Sim3& out_from_world) {
  check(pixel < reconstruction.num_pixels(), "unproject_pixel: pixel out of range");
  const size_t in_frame = pixel % reconstruction.pixels_per_frame();
  const size_t width = static_cast<size_t>(reconstruction.width);
  const PixelRays rays(reconstruction.views[pixel / reconstruction.pixels_per_frame()],
                       out_from_world);
  return rays.point(static_cast<int>(in_frame % width), static_cast<int>(in_frame / width),
                    reconstruction.depth[pixel]);
}

PointCloud unproject(const Reconstruction& reconstruction, float min_confidence,
                     const Sim3& out_from_world) {
  const ConfidentPixels pixels(reconstruction, min_confidence);
  PointCloud cloud{LargeArray<Eigen::Vector3f>(pixels.size()), LargeArray<float>(pixels.size()),
                   LargeArray<uint32_t>(pixels.size())};
  pixels.for_each_point(out_from_world, [&](size_t i, size_t pixel, const Eigen::Vector3f& x) {
    cloud.positions[i] = x;
    cloud.confidence[i] = reconstruction.confidence[pixel];
    cloud.pixels[i] = static_cast<uint32_t>(pixel);
  });
  return cloud;
}

LargeArray<Eigen::Vector3f> unproject_positions(const Reconstruction& reconstruction,
                                                float min_confidence, const Sim3& out_from_world) {
  const ConfidentPixels pixels(reconstruction, min_confidence);
  LargeArray<Eigen::Vector3f> positions(pixels.size());
  pixels.for_each_point(out_from_world,
                        [&](size_t i, size_t, const Eigen::Vector3f& x) { positions[i] = x; });
  return positions;
}

}  // namespace vggtcd
