// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/geometry/pose_encoding.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <array>
#include <fstream>
#include <nlohmann/json.hpp>

namespace vggtcd {
namespace {

nlohmann::json golden() {
  std::ifstream file(VGGTCD_SOURCE_DIR "/tests/golden/pose_encoding/pose_encoding.json");
  return nlohmann::json::parse(file);
}

TEST(PoseEncoding, ExtrinsicMatchesTheReference) {
  const auto cases = golden();
  for (size_t i = 0; i < cases["pose_enc"].size(); ++i) {
    const auto encoding = cases["pose_enc"][i].get<std::array<float, 9>>();
    const auto expected = cases["extrinsic"][i].get<std::array<double, 12>>();
    const Rigid3 camera_from_world = camera_from_world_of(encoding);
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        // The reference computes in f32.
        EXPECT_NEAR(camera_from_world.rotation(row, column), expected[size_t(row * 4 + column)],
                    1e-6);
      }
      EXPECT_NEAR(camera_from_world.translation[row], expected[size_t(row * 4 + 3)], 1e-6);
    }
    EXPECT_NEAR(camera_from_world.rotation.determinant(), 1, 1e-12);
  }
}

TEST(PoseEncoding, IntrinsicMatchesTheReference) {
  const auto cases = golden();
  for (const auto& [key, height, width] :
       {std::tuple{"intrinsic_392x518", 392, 518}, std::tuple{"intrinsic_70x98", 70, 98}}) {
    for (size_t i = 0; i < cases["pose_enc"].size(); ++i) {
      const auto encoding = cases["pose_enc"][i].get<std::array<float, 9>>();
      const auto expected = cases[key][i].get<std::array<double, 9>>();
      const Pinhole pinhole = pinhole_of(encoding, height, width);
      EXPECT_NEAR(pinhole.fx, expected[0], 1e-6 * expected[0]) << key << " row " << i;
      EXPECT_NEAR(pinhole.fy, expected[4], 1e-6 * expected[4]) << key << " row " << i;
      EXPECT_EQ(pinhole.cx, expected[2]);
      EXPECT_EQ(pinhole.cy, expected[5]);
    }
  }
}

TEST(PoseEncoding, LengthOfTheQuaternionDoesNotMatter) {
  const Eigen::Vector4d xyzw(0.1, -0.7, 0.3, 0.4);
  EXPECT_LT((rotation_from_quaternion(xyzw) - rotation_from_quaternion(-3 * xyzw)).norm(), 1e-14);
}

}  // namespace
}  // namespace vggtcd
