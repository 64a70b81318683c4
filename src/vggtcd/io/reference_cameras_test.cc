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

// One camera "a b.JPG" at (1.5, -2, 1000), as programs save it.
TEST(ReferenceCameras, SpreadsheetsAndSurveyProgramsSayTheSameInManyWays) {
  for (const char* text : {
           "a b.JPG,1.5,-2,1000\n",
           "\xef\xbb\xbf"
           "a b.JPG,1.5,-2,1000\r\n",                                // Excel, "CSV UTF-8"
           "\"name\",\"x\",\"y\",\"z\"\n\"a b.JPG\",1.5,-2,1000\n",  // R
           "\"a b.JPG\",\"1.5\",\"-2\",\"1000\"\n",                  // everything quoted
           "a b.JPG,+1.5,-2.0,+1000\n",                              // printf %+f
           "a b.JPG;1,5;-2;1000\n",                                  // German Excel
           "a b.JPG\t1,5\t-2,0\t1,0e3\n",                            // the same as text
           "Foto;Ost;Nord;H\xc3\xb6he\na b.JPG;1,5;-2;1000;;\n;;;\n",
           "D:\\a\\b\\a b.JPG,1.5,-2,1000\n",  // paths of Windows
           "#name,x,y,alt,heading,pitch,roll\na b.JPG,1.5,-2,1000,10.5,80.1,0.2\n",  // RealityScan
           "id,z,y,x,photo\n7,1000,-2,1.5,a b.JPG\n",  // another order
           "Northing [m];Easting [m];Height [m];File\n-2;1.5;1000;a b.JPG\n",
           "name x y z yaw pitch roll\na b.JPG 1.5 -2 1000 10 20 30\n",  // ODM, with a heading
           "# x y z are in metres\na b.JPG 1.5 -2 1000\n",
           "# CoordinateSystem: PROJCS[\"WGS 84 / UTM zone 33N\",...]\n"  // Metashape
           "#Label,X/Easting,Y/Northing,Z/Altitude,Yaw\na b.JPG,1.5,-2,1000,7\n",
           "#Label,X/Longitude,Y/Latitude,Z/Altitude,Yaw\n"
           "# CoordinateSystem: LOCAL_CS[\"Local\",UNIT[\"metre\",1]]\na b.JPG,1.5,-2,1000,7\n",
       }) {
    const auto cameras = read_text(text);
    ASSERT_EQ(cameras.size(), 1u) << text;
    EXPECT_EQ(cameras[0].name.substr(cameras[0].name.rfind('/') + 1), "a b.JPG") << text;
    EXPECT_EQ(cameras[0].center_m, Eigen::Vector3d(1.5, -2, 1000)) << text;
  }
  EXPECT_EQ(read_text("D:\\x\\a.jpg,1,2,3\n").at(0).name, "D:/x/a.jpg");
  EXPECT_EQ(read_text("\"a \"\"b\"\".jpg\",1,2,3\n").at(0).name, "a \"b\".jpg");
  EXPECT_EQ(read_text("\"a, b.jpg\",1,2,3\n").at(0).name, "a, b.jpg");
}

TEST(ReferenceCameras, EightNumbersAreTumWithAHeadingOrWithout) {
  for (const char* text :
       {"7.5 1 2 3 0 0 0 1\n", "# timestamp tx ty tz qx qy qz qw\n7.5 1 2 3 0 0 0 1\n",
        "7.5,1,2,3,0,0,0,1\n"}) {
    const auto cameras = read_text(text);
    ASSERT_EQ(cameras.size(), 1u) << text;
    EXPECT_EQ(cameras[0].name, "7.5");
    EXPECT_EQ(cameras[0].center_m, Eigen::Vector3d(1, 2, 3));
  }
}

TEST(ReferenceCameras, WhatIsNoMetresOrNobodyCanTellIsRefused) {
  const char* const metres = "expected camera positions in metres";
  for (const char* text : {
           "name,latitude,longitude,altitude\na.jpg,47.1,8.5,412\n",
           "photo;Breite;L\xc3\xa4nge;H\xc3\xb6he\na.jpg;47,1;8,5;412\n",
           "#name,lat,lon,alt\na.jpg,47.1,8.5,412\n",
           "name,x_ft,y_ft,z_ft\na.jpg,1,2,3\n",
           "name,x (ft),y (ft),z (ft)\na.jpg,1,2,3\n",
           "EPSG:32633\na.jpg 500123 4649776 100\n",
           "WGS84 UTM 32N\na.jpg 500123 4649776 100\n",
           "+proj=longlat +datum=WGS84\na.jpg 8.5 47.1 412\n",
           "# CoordinateSystem: GEOGCS[\"WGS 84\",...]\n#Label,X/Longitude,Y/Latitude,Z/Altitude\n"
           "a.jpg,8.5,47.1,412\n",
           "#Label,X/Longitude,Y/Latitude,Z/Altitude\na.jpg,8.5,47.1,412\n",
           "# CRS: EPSG:2263 (US survey feet)\na.jpg,1,2,3\n",
       }) {
    EXPECT_INPUT_ERROR(read_text(text), metres) << text;
  }
  const auto expect = [](const char* text, std::string_view part) {
    EXPECT_INPUT_ERROR(read_text(text), part) << text;
  };
  // Heading, pitch and roll are not x, y and z.
  expect("a.jpg,1,2,3,10.5,80.1,0.2\n",
         "cameras.txt:1: expected 4 columns, found 7; name the columns");
  expect("a.jpg 1 2 3 10.5 80.1 0.2\n",
         "cameras.txt:1: expected name x y z, found more than three");
  expect("a.jpg,1,5,2,5,3,5\n", "found 7; name the columns");  // decimal commas between commas
  expect("name,x,y,z\na.jpg,1,5,2,5,3,5\n", "cameras.txt:2: expected 4 columns, found 7");
  expect("a.jpg;1.234;2;3\nb.jpg;1,5;2;3\n", "cameras.txt:2: expected one decimal sign");
  expect("a.jpg;1.234,5;2;3\n", "expected a number, found \"1.234,5\"");
  expect("photo,a,b,c,d,e\nx.jpg,1,2,3,4,5\n",
         "cameras.txt:1: expected a header with name, x, y and z");
  // A first line that would be a photo is not thrown away as a heading.
  expect("a1.jpg,n/a,n/a,n/a\nb1.jpg,1,2,3\n", "cameras.txt:1: expected a number, found \"n/a\"");
  expect("a.jpg 1 2 1e308\n", "cameras.txt:1: expected coordinates from -1e13 to 1e13");
  expect(",1,2,3\n", "expected the name of a photo");
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
