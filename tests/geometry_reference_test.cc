// SPDX-License-Identifier: Apache-2.0
// Unprojection and shared intrinsics against the reference implementation
// (tests/golden/geometry_reference).
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "vggtcd/io/npz.h"
#include "vggtcd/registration/shared_intrinsics.h"
#include "vggtcd/scene/point_cloud.h"

namespace vggtcd {
namespace {

const NpzReader& reference() {
  static const NpzReader npz(std::filesystem::path(VGGTCD_SOURCE_DIR) /
                             "tests/golden/geometry_reference/reference.npz");
  return npz;
}

// Frames with these intrinsics [S, 3, 3] and depths [S, H, W]; poses and colours are not of
// interest.
Reconstruction frames_of(const std::string& intrinsics_key, const std::string& depth_key) {
  const auto& shape = reference().header(depth_key).shape;
  Reconstruction r;
  r.height = static_cast<int>(shape[1]);
  r.width = static_cast<int>(shape[2]);
  const std::vector<double> k = reference().read<double>(intrinsics_key);
  for (size_t s = 0; s < static_cast<size_t>(shape[0]); ++s) {
    View view;
    view.pinhole = {k[9 * s], k[9 * s + 4], k[9 * s + 2], k[9 * s + 5], r.width, r.height};
    r.views.push_back(view);
  }
  r.depth = reference().read<float>(depth_key);
  r.confidence.assign(r.depth.size(), 1.0f);
  r.color.assign(3 * r.depth.size(), 0);
  check_consistent(r);
  return r;
}

TEST(ShareIntrinsics, EqualsTheReferenceWithFrameZeroAsReference) {
  Reconstruction r = frames_of("intrinsics", "depths");
  share_intrinsics(r);
  const std::vector<double> k = reference().read<double>("intrinsics_aligned_ref0");
  const std::vector<float> depth = reference().read<float>("depths_aligned_ref0");
  constexpr double kRelative = 1e-6;  // the reference computes in float
  for (size_t s = 0; s < r.views.size(); ++s) {
    const Pinhole& pinhole = r.views[s].pinhole;
    EXPECT_NEAR(pinhole.fx, k[9 * s], kRelative * k[9 * s]);
    EXPECT_NEAR(pinhole.fy, k[9 * s + 4], kRelative * k[9 * s + 4]);
    EXPECT_NEAR(pinhole.cx, k[9 * s + 2], kRelative * k[9 * s + 2]);
    EXPECT_NEAR(pinhole.cy, k[9 * s + 5], kRelative * k[9 * s + 5]);
  }
  for (size_t i = 0; i < depth.size(); ++i) {
    EXPECT_NEAR(r.depth[i], depth[i], kRelative * std::abs(depth[i])) << "pixel " << i;
  }
}

TEST(UnprojectPixel, EqualsTheReference) {
  Reconstruction r = frames_of("unproject_intrinsic", "unproject_depth");
  const std::vector<double> pose = reference().read<double>("unproject_extrinsic");
  for (size_t s = 0; s < r.views.size(); ++s) {
    Rigid3& camera_from_world = r.views[s].camera_from_world;
    for (int row = 0; row < 3; ++row) {
      const size_t first = 12 * s + 4 * static_cast<size_t>(row);
      for (int column = 0; column < 3; ++column) {
        camera_from_world.rotation(row, column) = pose[first + static_cast<size_t>(column)];
      }
      camera_from_world.translation[row] = pose[first + 3];
    }
  }
  const std::vector<double> points = reference().read<double>("unproject_world_points");
  double largest = 0;
  for (size_t i = 0; i < r.num_pixels(); ++i) {
    const Eigen::Vector3f x = unproject_pixel(r, static_cast<uint32_t>(i));
    for (size_t axis = 0; axis < 3; ++axis) {
      const double error = std::abs(x[static_cast<Eigen::Index>(axis)] - points[3 * i + axis]);
      largest = std::max(largest, error);
    }
  }
  // Points reach 8 units; our positions are float. (Poses are orthonormal to float precision only.)
  EXPECT_LT(largest, 2e-6);
}

}  // namespace
}  // namespace vggtcd
