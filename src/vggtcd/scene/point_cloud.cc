// SPDX-License-Identifier: Apache-2.0
// Depth maps to points (Eq. 1 of the paper).
#include "vggtcd/scene/point_cloud.h"

#include <limits>
#include <numeric>
#include <vector>

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"

namespace vggtcd {
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

ConfidentPoints::ConfidentPoints(const Reconstruction& reconstruction, float min_confidence,
                                 const Sim3& out_from_world)
    : reconstruction_(reconstruction),
      min_confidence_(min_confidence),
      out_from_world_(out_from_world),
      starts_(reconstruction.views.size() + 1, 0) {
  check(reconstruction.num_pixels() <= std::numeric_limits<uint32_t>::max(),
        "unproject: more than 2^32 pixels");
  parallel_for(reconstruction.num_frames(), 1, [&](int64_t frame, int64_t) {
    const size_t begin = static_cast<size_t>(frame) * reconstruction.pixels_per_frame();
    const size_t end = begin + reconstruction.pixels_per_frame();
    size_t count = 0;
    for (size_t pixel = begin; pixel < end; ++pixel) count += keep(pixel) ? 1 : 0;
    starts_[static_cast<size_t>(frame) + 1] = count;
  });
  std::partial_sum(starts_.begin(), starts_.end(), starts_.begin());
}

std::span<const Eigen::Vector3f> ConfidentPoints::chunk(
    size_t frame, std::vector<Eigen::Vector3f>& memory) const {
  memory.resize(starts_[frame + 1] - starts_[frame]);
  for_each_point(
      frame, [&](size_t i, size_t, const Eigen::Vector3f& x) { memory[i - starts_[frame]] = x; });
  return memory;
}

PointCloud unproject(const Reconstruction& reconstruction, float min_confidence,
                     const Sim3& out_from_world) {
  const ConfidentPoints points(reconstruction, min_confidence, out_from_world);
  PointCloud cloud{LargeArray<Eigen::Vector3f>(points.size()), LargeArray<float>(points.size()),
                   LargeArray<uint32_t>(points.size())};
  parallel_for(reconstruction.num_frames(), 1, [&](int64_t frame, int64_t) {
    points.for_each_point(static_cast<size_t>(frame),
                          [&](size_t i, size_t pixel, const Eigen::Vector3f& x) {
                            cloud.positions[i] = x;
                            cloud.confidence[i] = reconstruction.confidence[pixel];
                            cloud.pixels[i] = static_cast<uint32_t>(pixel);
                          });
  });
  return cloud;
}

}  // namespace vggtcd
