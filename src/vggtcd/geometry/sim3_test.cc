// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/geometry/sim3.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>

#include "vggtcd/geometry/pinhole.h"

namespace vggtcd {
namespace {

Eigen::Matrix3d rotation_of(double angle_rad, const Eigen::Vector3d& axis) {
  return Eigen::AngleAxisd(angle_rad, axis.normalized()).toRotationMatrix();
}

const Sim3 kB{0.4, rotation_of(1.2, {1, -2, 0.5}), {3, -1, 2}};
const Sim3 kC{2.5, rotation_of(-2.9, {0.1, 1, 1}), {0.2, 5, -7}};
const Eigen::Vector3d kX(0.3, -4, 11);

TEST(Sim3, CompositionIsApplicationInTurn) {
  EXPECT_LT(((kC * kB) * kX - kC * (kB * kX)).norm(), 1e-12);
}

TEST(Sim3, InverseUndoes) {
  EXPECT_LT((kB.inverse() * (kB * kX) - kX).norm(), 1e-12);
  EXPECT_LT(((kB * kB.inverse()) * kX - kX).norm(), 1e-12);
}

TEST(Rigid3, CompositionAndInverse) {
  const Rigid3 a{kB.rotation, kB.translation}, b{kC.rotation, kC.translation};
  EXPECT_LT(((b * a) * kX - b * (a * kX)).norm(), 1e-12);
  EXPECT_LT((a.inverse() * (a * kX) - kX).norm(), 1e-12);
}

TEST(Rigid3, CameraCenterMapsToOrigin) {
  const Rigid3 camera_from_world{kB.rotation, kB.translation};
  EXPECT_LT((camera_from_world * camera_center(camera_from_world)).norm(), 1e-12);
}

TEST(CameraFromNewWorld, SeesMovedPointsInTheSameDirectionAtScaledDepth) {
  const Rigid3 camera_from_old{kC.rotation, kC.translation};
  const Rigid3 camera_from_new = camera_from_new_world(camera_from_old, kB);
  EXPECT_LT((camera_from_new * (kB * kX) - kB.scale * (camera_from_old * kX)).norm(), 1e-12);
}

TEST(RotationAngle, IsAccurateAtBothEnds) {
  for (const double angle : {0.0, 1e-9, 1e-3, 1.0, 3.0, std::numbers::pi - 1e-6}) {
    EXPECT_NEAR(rotation_angle_rad(rotation_of(angle, {1, 2, 3})), angle, 1e-9);
  }
}

TEST(Pinhole, ProjectUndoesUnproject) {
  const Pinhole pinhole{500, 510, 259, 196, 518, 392};
  const Eigen::Vector3d x = pinhole.unproject(17, 301, 4.5);
  EXPECT_EQ(x.z(), 4.5);
  EXPECT_LT((pinhole.project(x) - Eigen::Vector2d(17, 301)).norm(), 1e-12);
}

TEST(Pinhole, ContainsPixelsWhoseCentreIsAnInteger) {
  const Pinhole pinhole{500, 510, 259, 196, 518, 392};
  EXPECT_TRUE(pinhole.contains(-0.5, 0));
  EXPECT_TRUE(pinhole.contains(517.4, 391.4));
  EXPECT_FALSE(pinhole.contains(517.5, 0));
  EXPECT_FALSE(pinhole.contains(0, -0.6));
}

}  // namespace
}  // namespace vggtcd
