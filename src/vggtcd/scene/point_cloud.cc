// SPDX-License-Identifier: Apache-2.0
// Depth maps to points (Eq. 1 of the paper).
#include "vggtcd/scene/point_cloud.h"

#include <limits>

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

PointCloud unproject(const Reconstruction& reconstruction, float min_confidence,
                     const Sim3& out_from_world) {
  const int64_t frames = reconstruction.num_frames();
  const size_t per_frame = reconstruction.pixels_per_frame();
  check(reconstruction.num_pixels() <= std::numeric_limits<uint32_t>::max(),
        "unproject: more than 2^32 pixels");
  const auto keep = [&](size_t pixel) {
    return is_confident(reconstruction, pixel, min_confidence);
  };
  // Count per frame, so that every frame knows where its points go: same order on any thread count.
  std::vector<size_t> first(static_cast<size_t>(frames) + 1, 0);
  parallel_for(frames, 1, [&](int64_t frame, int64_t) {
    const size_t begin = static_cast<size_t>(frame) * per_frame;
    size_t count = 0;
    for (size_t pixel = begin; pixel < begin + per_frame; ++pixel) count += keep(pixel) ? 1 : 0;
    first[static_cast<size_t>(frame) + 1] = count;
  });
  for (size_t frame = 0; frame < static_cast<size_t>(frames); ++frame)
    first[frame + 1] += first[frame];

  PointCloud cloud;
  cloud.positions.resize(first.back());
  cloud.confidence.resize(first.back());
  cloud.pixels.resize(first.back());
  parallel_for(frames, 1, [&](int64_t frame, int64_t) {
    const PixelRays rays(reconstruction.views[static_cast<size_t>(frame)], out_from_world);
    size_t pixel = static_cast<size_t>(frame) * per_frame;
    size_t out = first[static_cast<size_t>(frame)];
    for (int v = 0; v < reconstruction.height; ++v) {
      for (int u = 0; u < reconstruction.width; ++u, ++pixel) {
        if (!keep(pixel)) continue;
        cloud.positions[out] = rays.point(u, v, reconstruction.depth[pixel]);
        cloud.confidence[out] = reconstruction.confidence[pixel];
        cloud.pixels[out] = static_cast<uint32_t>(pixel);
        ++out;
      }
    }
  });
  return cloud;
}

}  // namespace vggtcd
