// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/trajectory.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>
#include <cstdio>

#include "tests/support/test_files.h"
#include "vggtcd/io/npy.h"
#include "vggtcd/io/tum.h"

namespace vggtcd {
namespace {

Trajectory three_poses() {
  Trajectory trajectory;
  for (int i = 0; i < 3; ++i) {
    Rigid3 pose;
    pose.rotation =
        Eigen::AngleAxisd(1.4 * i, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
    pose.translation = {1.0 / 3, -2.5 * i, 1e-9};
    trajectory.push_back({std::to_string(i), pose});
  }
  return trajectory;
}

void expect_same(const Trajectory& a, const Trajectory& b) {
  ASSERT_EQ(a.size(), b.size());
  for (size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].name, b[i].name);
    // Double precision through a quaternion and two inversions, translations up to 5.
    EXPECT_LT((a[i].camera_from_world.rotation - b[i].camera_from_world.rotation).norm(), 1e-14);
    EXPECT_LT((a[i].camera_from_world.translation - b[i].camera_from_world.translation).norm(),
              1e-13);
  }
}

TEST(Tum, ALineIsThePositionAndOrientationOfTheCameraInTheWorld) {
  const TemporaryDirectory directory;
  // A camera at (1, 2, 3) whose x axis points along world y: world-from-camera turns by 90 degrees
  // about z, quaternion z = w = sqrt(1/2).
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Rigid3 world_from_camera{turn, {1, 2, 3}};
  write_tum(directory / "a.tum", {{"x", world_from_camera.inverse()}});
  double t, x, y, z, qx, qy, qz, qw;
  const std::string text = file_bytes(directory / "a.tum");
  ASSERT_EQ(std::sscanf(text.c_str(), "# timestamp tx ty tz qx qy qz qw\n%lf%lf%lf%lf%lf%lf%lf%lf",
                        &t, &x, &y, &z, &qx, &qy, &qz, &qw),
            8);
  EXPECT_EQ(t, 0);
  EXPECT_NEAR(x, 1, 1e-15);
  EXPECT_NEAR(y, 2, 1e-15);
  EXPECT_NEAR(z, 3, 1e-15);
  EXPECT_NEAR(qx, 0, 1e-15);
  EXPECT_NEAR(qz, std::sqrt(0.5), 1e-15);
  EXPECT_NEAR(qw, std::sqrt(0.5), 1e-15);
}

TEST(Tum, ReadsBackWhatWasWritten) {
  const TemporaryDirectory directory;
  write_tum(directory / "a.tum", three_poses());
  expect_same(read_tum(directory / "a.tum"), three_poses());
}

TEST(Tum, RefusesBrokenLinesByNumber) {
  const TemporaryDirectory directory;
  const auto expect = [&](std::string_view content, std::string_view part) {
    write_bytes(directory / "a.tum", content);
    EXPECT_INPUT_ERROR(read_tum(directory / "a.tum"), part);
  };
  expect("", "expected camera poses, found none");
  expect("# only a comment\n", "expected camera poses, found none");
  expect("0 1 2 3 0 0 0\n", "a.tum:1: expected timestamp tx ty tz qx qy qz qw, found 7 words");
  expect("# c\n0 1 2 x 0 0 0 1\n", "a.tum:2: expected a number, found x");
  expect("0 1 2 3 0 0 0 0\n", "a.tum:1: expected a unit quaternion, found norm 0");
  // No inverse pose, no mean and no square of such numbers is right.
  expect("0 1 2 1.7e308 0 0 0 1\n", "a.tum:1: expected coordinates from -1e13 to 1e13");
  expect("0 1 2 -1e308 0 0 0 1\n", "a.tum:1: expected coordinates from -1e13 to 1e13");
  expect("0 1 2 1,5 0 0 0 1\n", "a.tum:1: expected a number with a decimal point, found 1,5");
  expect("0 1 2 +-3 0 0 0 1\n", "a.tum:1: expected a number, found +-3");
  expect(std::string("\xff\xfe"
                     "0\0",
                     4),
         "a.tum: expected text in UTF-8, found UTF-16");
  expect("0 1 2 \x01\xff 0 0 0 1\n", "expected a number, found ??");
}

TEST(Tum, ReadsWhatSpreadsheetsAndScriptsSave) {
  const TemporaryDirectory directory;
  write_bytes(directory / "a.tum",
              "\xef\xbb\xbf"
              "1.5 +1 -2 1e13 0 0 0 1\r2.5 0 0 0 0 0 0 +1\r\n");
  const TrajectoryFile file =
      read_trajectory_file(directory / "a.tum", PoseConvention::kCameraFromWorld);
  ASSERT_EQ(file.poses.size(), 2u);
  EXPECT_EQ(file.names, PoseNames::kTimeStamps);
  EXPECT_EQ(file.poses[0].name, "1.5");
  EXPECT_EQ(camera_center(file.poses[0].camera_from_world), Eigen::Vector3d(1, -2, 1e13));
}

TEST(ReadTrajectory, NumbersInOrderAreNoTimeStamps) {
  const TemporaryDirectory directory;
  const auto names_of = [&](std::string_view content) {
    write_bytes(directory / "a.tum", content);
    return read_trajectory_file(directory / "a.tum", PoseConvention::kCameraFromWorld).names;
  };
  EXPECT_EQ(names_of("0 0 0 0 0 0 0 1\n1.0 0 0 0 0 0 0 1\n"), PoseNames::kNumbers);
  EXPECT_EQ(names_of("1 0 0 0 0 0 0 1\n0 0 0 0 0 0 0 1\n"), PoseNames::kTimeStamps);
  EXPECT_EQ(names_of("1 0 0 0 0 0 0 1\n2 0 0 0 0 0 0 1\n"), PoseNames::kTimeStamps);
}

TEST(ReadTrajectory, NumpyPosesFarBeyondAnyPlaceAreRefused) {
  const TemporaryDirectory directory;
  const std::vector<int64_t> shape{1, 3, 4};
  const std::vector<double> values{1, 0, 0, 0, 0, 1, 0, -1e308, 0, 0, 1, 0};
  write_npy_file(directory / "a.npy", shape, values);
  EXPECT_INPUT_ERROR(read_trajectory(directory / "a.npy", PoseConvention::kWorldFromCamera),
                     "a.npy: pose 0: expected coordinates from -1e13 to 1e13");
}

TEST(ReadTrajectory, NumpyPosesInBothConventions) {
  const TemporaryDirectory directory;
  for (const auto convention :
       {PoseConvention::kCameraFromWorld, PoseConvention::kWorldFromCamera}) {
    write_npy_poses(directory / "a.npy", three_poses(), convention);
    expect_same(read_trajectory(directory / "a.npy", convention), three_poses());
  }
  // The file just written is world-from-camera: its last column is where the camera is.
  const NpyDoubles array = read_npy_file(directory / "a.npy");
  const Eigen::Vector3d centre = camera_center(three_poses()[1].camera_from_world);
  EXPECT_EQ(array.values[16 + 3], centre.x());
  EXPECT_EQ(array.values[16 + 15], 1.0);
}

TEST(ReadTrajectory, NumpyPosesWithoutLastRow) {
  const TemporaryDirectory directory;
  const std::vector<int64_t> shape{1, 3, 4};
  const std::vector<double> values{0, -1, 0, 5, 1, 0, 0, 6, 0, 0, 1, 7};
  write_npy_file(directory / "a.npy", shape, values);
  const Trajectory t = read_trajectory(directory / "a.npy", PoseConvention::kCameraFromWorld);
  ASSERT_EQ(t.size(), 1u);
  EXPECT_LT((t[0].camera_from_world * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(5, 7, 7)).norm(),
            1e-15);
}

TEST(ReadTrajectory, ChoosesTheReaderByTheName) {
  const TemporaryDirectory directory;
  const auto read = [](const std::filesystem::path& path) {
    return read_trajectory(path, PoseConvention::kCameraFromWorld);
  };
  const std::filesystem::path model = source_file("tests/golden/geometry_files/colmap_txt");
  EXPECT_EQ(read(model).size(), 3u);
  EXPECT_EQ(read(model / "images.txt").size(), 3u);
  write_tum(directory / "a.txt", three_poses());
  EXPECT_EQ(read(directory / "a.txt").size(), 3u);
  EXPECT_INPUT_ERROR(read(directory / "none.npy"), "found no such file");
  EXPECT_INPUT_ERROR(read(source_file("tests/golden/npz/f32_2x3.npy")),
                     "expected poses of shape [N, 4, 4] or [N, 3, 4], found [2, 3]");
  // Matrices 0..15, 16..31, ...: (4, 3, 4), but no rotations.
  EXPECT_INPUT_ERROR(read(source_file("tests/golden/npz/f64_fortran_4x3x4.npy")),
                     "pose 0: expected a rotation");
}

}  // namespace
}  // namespace vggtcd
