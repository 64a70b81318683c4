// SPDX-License-Identifier: Apache-2.0
// Photos as an ideal camera would have taken them: COLMAP's SIMPLE_RADIAL model, evaluated
// forwards.
#include "vggtcd/reconstruction/undistort.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

namespace vggtcd {

Pinhole covering_pinhole(const RadialCamera& camera, int width, int height) {
  const double scale = std::max(static_cast<double>(width) / camera.width,
                                static_cast<double>(height) / camera.height);
  const double focal = camera.focal_px * scale;
  // Distances of pixel centres from the middles of the two pictures.
  const double cx = 0.5 * (width - 1) + scale * (camera.cx - 0.5 * (camera.width - 1));
  const double cy = 0.5 * (height - 1) + scale * (camera.cy - 0.5 * (camera.height - 1));
  return {focal, focal, cx, cy, width, height};
}

UndistortedPhoto undistort(const Image& photo, const RadialCamera& camera, const Pinhole& pinhole) {
  const cv::Mat source(photo.height, photo.width, CV_8UC3, const_cast<uint8_t*>(photo.rgb.data()));
  const double scale = std::min(1.0, pinhole.fx / camera.focal_px);
  cv::Mat small = source;
  if (scale < 1) {
    cv::resize(source, small,
               cv::Size(std::max(1, static_cast<int>(photo.width * scale + 0.5)),
                        std::max(1, static_cast<int>(photo.height * scale + 0.5))),
               0, 0, cv::INTER_AREA);
  }
  const double small_per_source_x = static_cast<double>(small.cols) / photo.width;
  const double small_per_source_y = static_cast<double>(small.rows) / photo.height;
  cv::Mat map_x(pinhole.height, pinhole.width, CV_32F),
      map_y(pinhole.height, pinhole.width, CV_32F);
  UndistortedPhoto out{Image(pinhole.width, pinhole.height), {}};
  out.valid.reserve(out.color.rgb.size() / 3);
  for (int v = 0; v < pinhole.height; ++v) {
    for (int u = 0; u < pinhole.width; ++u) {
      const Eigen::Vector3d x = pinhole.unproject(u, v, 1.0);
      const double bend = 1.0 + camera.k * (x.x() * x.x() + x.y() * x.y());
      const double source_u = camera.focal_px * bend * x.x() + camera.cx;
      const double source_v = camera.focal_px * bend * x.y() + camera.cy;
      map_x.at<float>(v, u) = static_cast<float>((source_u + 0.5) * small_per_source_x - 0.5);
      map_y.at<float>(v, u) = static_cast<float>((source_v + 0.5) * small_per_source_y - 0.5);
      const bool inside = source_u >= -0.5 && source_v >= -0.5 && source_u <= photo.width - 0.5 &&
                          source_v <= photo.height - 0.5;
      out.valid.push_back(inside ? 1 : 0);
    }
  }
  cv::Mat target(pinhole.height, pinhole.width, CV_8UC3, out.color.rgb.data());
  cv::remap(small, target, map_x, map_y, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return out;
}

std::vector<float> brightness(const Image& image) {
  std::vector<float> gray;
  gray.reserve(image.rgb.size() / 3);
  for (size_t i = 0; i < image.rgb.size(); i += 3) {
    const uint8_t* c = image.rgb.data() + i;
    gray.push_back(0.299f * c[0] + 0.587f * c[1] + 0.114f * c[2]);  // ITU-R BT.601
  }
  return gray;
}

}  // namespace vggtcd
