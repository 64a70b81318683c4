// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/scene/local_frame.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "tests/support/toy_scene.h"
#include "vggtcd/scene/point_cloud.h"

namespace vggtcd {
namespace {

using testing_support::reconstruct;
using testing_support::ToyScene;

std::vector<Eigen::Vector3d> centers_of(const Reconstruction& r) {
  std::vector<Eigen::Vector3d> centers;
  for (const View& view : r.views) centers.push_back(camera_center(view.camera_from_world));
  return centers;
}

TEST(LocalOrigin, IsZeroForScenesNearTheirOwn) {
  EXPECT_EQ(local_origin({99, -99, 0}, 1.0), Eigen::Vector3d::Zero());
  EXPECT_EQ(local_origin({9.9e-8, 0, 0}, 1e-9), Eigen::Vector3d::Zero());
}

TEST(LocalOrigin, LiesWithinASizeOfFarScenesInWholeSteps) {
  const Eigen::Vector3d middle(500123.7, 4649776.2, 101.3);
  for (const double size : {1e-3, 0.9, 5.0, 3000.0}) {
    const Eigen::Vector3d origin = local_origin(middle, size);
    EXPECT_LE((origin - middle).cwiseAbs().maxCoeff(), 0.5 * size) << size;
    const double step = std::exp2(std::floor(std::log2(size)));
    for (const double x : origin) EXPECT_EQ(std::remainder(x, step), 0) << size;
  }
}

TEST(UseLocalFrame, LeavesNearFramesAsTheyAre) {
  Reconstruction r = reconstruct(ToyScene{}, {});
  const std::vector<View> before = r.views;
  use_local_frame(r, centers_of(r));
  EXPECT_TRUE(r.origin_in_world.isZero(0));
  for (size_t i = 0; i < before.size(); ++i) {
    EXPECT_EQ(r.views[i].camera_from_world.translation, before[i].camera_from_world.translation);
  }
}

TEST(UseLocalFrame, PointsOfAFarFrameAreThoseOfTheNearOne) {
  const Sim3 far{1.0,
                 Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).matrix(),
                 {691234.25, 5334321.5, 512.0}};
  const Reconstruction near = reconstruct(ToyScene{}, {1.0, far.rotation, {0, 0, 0}});
  Reconstruction r = reconstruct(ToyScene{}, far);
  // What floats make of it: half a unit is lost.
  EXPECT_GT((unproject_pixel(r, 100).cast<double>() - far.translation -
             unproject_pixel(near, 100).cast<double>())
                .norm(),
            1e-2);
  use_local_frame(r, centers_of(r));
  ASSERT_FALSE(r.origin_in_world.isZero(0));
  for (const uint32_t pixel : {0u, 100u, 1000u}) {
    const Eigen::Vector3d in_world = r.origin_in_world + unproject_pixel(r, pixel).cast<double>();
    const Eigen::Vector3d expected = far.translation + unproject_pixel(near, pixel).cast<double>();
    EXPECT_LT((in_world - expected).norm(), 5e-6) << pixel;  // a float at the scene's size
  }
}

TEST(UseLocalFrame, OneCameraFarAwayDoesNotMoveIt) {
  Reconstruction r = reconstruct(ToyScene{}, {});
  std::vector<Eigen::Vector3d> centers = centers_of(r);
  for (const double x : {1e9, 1e308, static_cast<double>(NAN)}) {
    centers[0] = {x, 0, 0};
    use_local_frame(r, centers);
    EXPECT_TRUE(r.origin_in_world.isZero(0)) << x;
  }
}

TEST(BetweenWorlds, MapsThePointsThatTheLocalSimilarityMaps) {
  const Sim3 local{1.7, Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitY()).matrix(), {1, 2, 3}};
  const Eigen::Vector3d a(5e5, 4e6, 100), b(-2e4, 7, 1e6), x(0.5, -2, 3);
  const Sim3 world = between_worlds(local, a, b);
  EXPECT_LT((world * (a + x) - (b + local * x)).norm(), 1e-8);
  const Sim3 back = between_local_frames(world, a, b);
  EXPECT_LT((back.translation - local.translation).norm(), 1e-8);
  EXPECT_EQ(between_worlds(local, Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()).translation,
            local.translation);
}

TEST(CameraFromWorld, SeesTheSamePointThere) {
  const Rigid3 pose{Eigen::AngleAxisd(1.1, Eigen::Vector3d::UnitX()).matrix(), {1, -2, 0.5}};
  const Eigen::Vector3d origin(691234, 5334321, 0), x(0.1, 0.2, 4);
  EXPECT_LT((camera_from_world(pose, origin) * (origin + x) - pose * x).norm(), 1e-8);
}

}  // namespace
}  // namespace vggtcd
