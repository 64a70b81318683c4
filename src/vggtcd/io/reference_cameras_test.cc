// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/reference_cameras.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/support/test_files.h"
#include "vggtcd/io/colmap.h"
#include "vggtcd/io/tum.h"

namespace vggtcd {
namespace {

std::vector<ReferenceCamera> read_text(std::string_view text) {
  const TemporaryDirectory directory;
  write_bytes(directory / "cameras.txt", text);
  return read_reference_cameras(directory / "cameras.txt");
}

TEST(ReferenceCameras, ATableHasANameAndThreeNumbersALine) {
  const auto cameras =
      read_text("# surveyed on Monday\nafter/IMG 3.jpg 1.5\t-2 1e3\n\nb.jpg 0 0 7\r\n");
  ASSERT_EQ(cameras.size(), 2u);
  EXPECT_EQ(cameras[0].name, "after/IMG 3.jpg");
  EXPECT_EQ(cameras[0].center_m, Eigen::Vector3d(1.5, -2, 1000));
  EXPECT_EQ(cameras[1].name, "b.jpg");
  EXPECT_EQ(cameras[1].center_m, Eigen::Vector3d(0, 0, 7));
}

TEST(ReferenceCameras, ASpreadsheetWithAHeadingIsATable) {
  for (const char* text : {"photo,x,y,z\na.jpg,1,2,3\n", "Foto;Ost;Nord;Hoehe\na.jpg; 1; 2; 3\n"}) {
    const auto cameras = read_text(text);
    ASSERT_EQ(cameras.size(), 1u) << text;
    EXPECT_EQ(cameras[0].name, "a.jpg");
    EXPECT_EQ(cameras[0].center_m, Eigen::Vector3d(1, 2, 3));
  }
}

TEST(ReferenceCameras, TumAndColmapGiveCameraCentres) {
  const TemporaryDirectory directory;
  View view;
  view.name = "before/a.jpg";
  view.pinhole = {100, 100, 10, 10, 21, 21};
  view.camera_from_world.rotation =
      Eigen::AngleAxisd(1, Eigen::Vector3d::UnitY()).toRotationMatrix();
  view.camera_from_world.translation = {1, 2, 3};
  const Eigen::Vector3d center = camera_center(view.camera_from_world);
  write_tum(directory / "a.tum", {{"", view.camera_from_world}});
  const auto from_tum = read_reference_cameras(directory / "a.tum");
  EXPECT_EQ(from_tum.at(0).name, "0");
  // Through a quaternion in double precision, at coordinates of a few units.
  EXPECT_LT((from_tum.at(0).center_m - center).norm(), 1e-13);
  std::filesystem::create_directory(directory / "model");
  write_colmap_text(directory / "model", {&view, 1});
  const auto from_colmap = read_reference_cameras(directory / "model");
  EXPECT_EQ(from_colmap.at(0).name, "before/a.jpg");
  EXPECT_LT((from_colmap.at(0).center_m - center).norm(), 1e-13);
}

TEST(ReferenceCameras, WhatIsNoTableIsNamedByItsLine) {
  EXPECT_INPUT_ERROR(read_text("a.jpg 1 2 3\nb.jpg 1 2\n"), "cameras.txt:2: expected name x y z");
  EXPECT_INPUT_ERROR(read_text("a.jpg 1 2 3\nb.jpg 1 x 2\n"), "cameras.txt:2: expected a number");
  EXPECT_INPUT_ERROR(read_text("a.jpg 1 2 nan\n"), "cameras.txt:1: expected a number");
  EXPECT_INPUT_ERROR(read_text("a.jpg 1 2 3\na.jpg 1 2 4\n"), "\"a.jpg\" twice");
  EXPECT_INPUT_ERROR(read_text("# nothing\n"), "found none");
  EXPECT_INPUT_ERROR(read_reference_cameras("/nowhere/cameras.txt"), "/nowhere/cameras.txt");
}

}  // namespace
}  // namespace vggtcd
