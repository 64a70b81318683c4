// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/scene/point_cloud.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

// Two frames of 4 x 3 pixels with distinct poses, depth 1, 2, 3, ... and confidence descending.
Reconstruction two_frames() {
  Reconstruction r;
  r.width = 4;
  r.height = 3;
  for (int frame = 0; frame < 2; ++frame) {
    View view;
    view.pinhole = {5, 6, 2, 1.5, 4, 3};
    view.camera_from_world.rotation =
        Eigen::AngleAxisd(0.3 + frame, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
    view.camera_from_world.translation = {0.1, -0.2 * frame, 0.5};
    r.views.push_back(view);
  }
  for (size_t i = 0; i < r.num_pixels(); ++i) {
    r.depth.push_back(static_cast<float>(i + 1));
    r.confidence.push_back(static_cast<float>(100 - i));
  }
  r.color.assign(3 * r.num_pixels(), 7);
  check_consistent(r);
  return r;
}

TEST(Unproject, PointsProjectBackToTheirPixelAtTheirDepth) {
  const Reconstruction r = two_frames();
  const Sim3 out_from_world{
      2.0, Eigen::AngleAxisd(1, Eigen::Vector3d::UnitX()).toRotationMatrix(), {1, 2, 3}};
  const PointCloud cloud = unproject(r, 0.0f, out_from_world);
  ASSERT_EQ(cloud.size(), r.num_pixels());
  for (size_t i = 0; i < cloud.size(); ++i) {
    const View& view = r.views[cloud.pixels[i] / 12];
    const Eigen::Vector3d x_in_camera =
        view.camera_from_world * (out_from_world.inverse() * cloud.positions[i].cast<double>());
    const Eigen::Vector2d uv = view.pinhole.project(x_in_camera);
    EXPECT_NEAR(x_in_camera.z(), r.depth[cloud.pixels[i]], 1e-5);
    EXPECT_NEAR(uv.x(), cloud.pixels[i] % 12 % 4, 1e-4);
    EXPECT_NEAR(uv.y(), cloud.pixels[i] % 12 / 4, 1e-4);
    EXPECT_EQ(cloud.positions[i], unproject_pixel(r, cloud.pixels[i], out_from_world));
  }
}

TEST(Unproject, DropsPixelsWithoutDepthAndAtOrBelowTheConfidence) {
  Reconstruction r = two_frames();
  r.depth[3] = 0;
  const PointCloud cloud = unproject(r, 90.0f);  // pixels 0..9 have confidence 100..91
  ASSERT_EQ(cloud.size(), 9u);
  EXPECT_EQ(cloud.pixels[3], 4u);
  EXPECT_EQ(cloud.pixels[8], 9u);
  const ConfidentPoints points(r, 90.0f);
  std::vector<Eigen::Vector3f> memory;
  ASSERT_THAT(points.starts(), testing::ElementsAre(0, 9, 9));
  EXPECT_TRUE(std::ranges::equal(points.chunk(0, memory), cloud.positions));
  EXPECT_TRUE(points.chunk(1, memory).empty());
}

TEST(CheckConsistent, RefusesAMissingArray) {
  Reconstruction r = two_frames();
  r.confidence.pop_back();
  EXPECT_THROW(check_consistent(r), Error);
}

}  // namespace
}  // namespace vggtcd
