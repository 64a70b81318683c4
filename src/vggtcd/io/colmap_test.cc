// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/colmap.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>

#include "tests/support/test_files.h"

namespace vggtcd {
namespace {

using testing::ElementsAre;

const char* const kText = "tests/golden/geometry_files/colmap_txt";
const char* const kBinary = "tests/golden/geometry_files/colmap_bin";

class ColmapGolden : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Forms, ColmapGolden, testing::Values(kText, kBinary));

// The values of tests/golden/geometry_files/make.py.
TEST_P(ColmapGolden, ReadsCamerasImagesAndPoints) {
  const ColmapModel model = read_colmap(source_file(GetParam()));
  ASSERT_EQ(model.cameras.size(), 2u);
  EXPECT_EQ(model.cameras.at(1).model, "PINHOLE");
  EXPECT_EQ(model.cameras.at(7).model, "OPENCV");
  EXPECT_EQ(model.cameras.at(7).width, 800);
  EXPECT_THAT(model.cameras.at(7).params,
              ElementsAre(700, 701, 400, 300, 0.1, -0.05, 0.001, 0.002));
  ASSERT_EQ(model.images.size(), 3u);
  const ColmapImage& image = model.images.at(3);
  EXPECT_EQ(image.name, "b with space.jpg");
  EXPECT_EQ(image.camera_id, 1u);
  // The quaternion (1, 1, 1, 1) / 2 turns x into y, y into z, z into x.
  EXPECT_LT((image.camera_from_world * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(1, 3, 3)).norm(),
            1e-15);
  // w = 0.8, y = -0.6: about y by -2 acos(0.8); cos = 0.28.
  EXPECT_NEAR(model.images.at(12).camera_from_world.rotation(0, 0), 0.28, 1e-15);
  EXPECT_NEAR(model.images.at(12).camera_from_world.rotation(2, 0), 0.96, 1e-15);
  ASSERT_EQ(model.points.size(), 2u);
  EXPECT_EQ(model.points[0].position, Eigen::Vector3d(0.5, -1.5, 2.5));
  EXPECT_THAT(model.points[0].rgb, ElementsAre(10, 20, 255));
  EXPECT_EQ(model.points[0].error_px, 0.75);
  EXPECT_THAT(model.points[0].image_ids, ElementsAre(3, 12));
  EXPECT_THAT(model.points[1].image_ids, ElementsAre());
}

TEST_P(ColmapGolden, TrajectoryIsInTheOrderOfNames) {
  const Trajectory trajectory = colmap_trajectory(read_colmap(source_file(GetParam())));
  ASSERT_EQ(trajectory.size(), 3u);
  EXPECT_EQ(trajectory[0].name, "a.jpg");
  EXPECT_EQ(trajectory[1].name, "b with space.jpg");
  EXPECT_EQ(trajectory[1].camera_from_world.translation, Eigen::Vector3d(1, 2, 3));
}

TEST(ColmapViews, MoveThePrincipalPointToIntegerPixelCentresAndRefuseDistortion) {
  ColmapModel model = read_colmap(source_file(kText));
  EXPECT_INPUT_ERROR(colmap_views(model), "COLMAP camera 7: expected PINHOLE, found OPENCV");
  model.images.erase(12);
  const std::vector<View> views = colmap_views(model);
  ASSERT_EQ(views.size(), 2u);
  EXPECT_EQ(views[0].pinhole.cx, 320);
  EXPECT_EQ(views[0].pinhole.cy, 240);
  EXPECT_EQ(views[0].pinhole.fy, 510);
  model.cameras[1] = {"SIMPLE_PINHOLE", 640, 480, {400, 320.5, 200.5}};
  EXPECT_EQ(colmap_views(model)[0].pinhole.fy, 400);
  EXPECT_EQ(colmap_views(model)[0].pinhole.cy, 200);
  model.cameras[1].width = int64_t{1} << 40;
  EXPECT_INPUT_ERROR(colmap_views(model), "expected a size in pixels");
}

std::vector<View> two_views() {
  std::vector<View> views(2);
  for (size_t i = 0; i < 2; ++i) {
    const double angle = 0.3 + 2 * static_cast<double>(i);
    views[i].camera_from_world.rotation =
        Eigen::AngleAxisd(angle, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
    views[i].camera_from_world.translation = {0.1, -1.0 / 3, 1e-7};
    views[i].pinhole = {501.25, 502.5, 259, 195.5, 518, 392};
    views[i].name = i == 0 ? "after/two.jpg" : "before/one two.jpg";
  }
  return views;
}

TEST(WriteColmap, ReadsBackInBothForms) {
  const std::vector<View> views = two_views();
  const std::vector<ColoredPoint> points{{{1, 2, 1.0 / 3}, {1, 2, 255}}};
  for (const bool binary : {false, true}) {
    const TemporaryDirectory directory;
    (binary ? write_colmap_binary : write_colmap_text)(directory.path(), views, points);
    EXPECT_EQ(directory.num_files(), 3u);
    const ColmapModel model = read_colmap(directory.path());
    const std::vector<View> back = colmap_views(model);
    ASSERT_EQ(back.size(), 2u);
    for (size_t i = 0; i < 2; ++i) {
      EXPECT_EQ(back[i].name, views[i].name);
      EXPECT_EQ(back[i].pinhole.matrix(), views[i].pinhole.matrix());
      EXPECT_EQ(back[i].pinhole.width, 518);
      EXPECT_EQ(back[i].camera_from_world.translation, views[i].camera_from_world.translation);
      // Matrix to quaternion and back in double precision.
      EXPECT_LT((back[i].camera_from_world.rotation - views[i].camera_from_world.rotation).norm(),
                1e-14);
    }
    ASSERT_EQ(model.points.size(), 1u);
    EXPECT_EQ(model.points[0].position, points[0].position);
    EXPECT_EQ(model.points[0].rgb, points[0].rgb);
  }
}

TEST(ReadColmap, RefusesBrokenTextByLine) {
  const auto expect = [](std::string_view file, std::string_view content, std::string_view part) {
    const TemporaryDirectory directory;
    for (const char* name : {"cameras.txt", "images.txt", "points3D.txt"}) {
      std::filesystem::copy_file(source_file(kText) / name, directory / name);
    }
    write_bytes(directory / file, content);
    EXPECT_INPUT_ERROR(read_colmap(directory.path()), part);
  };
  expect("cameras.txt", "1 PINHOLE 640 480 500 510 320\n",
         "cameras.txt:1: expected 4 parameters of PINHOLE, found 7 words");
  expect("cameras.txt", "# c\n1 FISHY 640 480 500\n", "cameras.txt:2: expected a COLMAP camera");
  expect("cameras.txt", "", "expected a camera 1 for image 3, found none");
  expect("images.txt", "1 1 0 0 0 0 0 0 1\n", "images.txt:1: expected at least 10 words");
  expect("images.txt", "1 1 0 0 0 0 nan 0 1 a.jpg\n", "images.txt:1: expected a number, found nan");
  expect("images.txt", "1 3 0 0 0 0 0 0 1 a.jpg\n", "expected a unit quaternion, found norm 3");
  expect("images.txt", "-1 1 0 0 0 0 0 0 1 a.jpg\n", "expected an id");
  expect("points3D.txt", "1 0 0 0 0 0 256 0\n", "expected a colour from 0 to 255, found 256");
}

TEST(ReadColmap, RefusesTruncationAnywhereInBinary) {
  for (const std::string name : {"cameras.bin", "images.bin", "points3D.bin"}) {
    const TemporaryDirectory directory;
    for (const char* other : {"cameras.bin", "images.bin", "points3D.bin"}) {
      std::filesystem::copy_file(source_file(kBinary) / other, directory / other);
    }
    const std::string bytes = file_bytes(source_file(kBinary) / name);
    for (size_t size = 0; size < bytes.size(); size += 5) {
      write_bytes(directory / name, bytes.substr(0, size));
      EXPECT_INPUT_ERROR(read_colmap(directory.path()), name) << size;
    }
  }
}

TEST(ReadColmap, SaysWhatIsMissing) {
  const TemporaryDirectory directory;
  EXPECT_INPUT_ERROR(read_colmap(directory.path()), "expected a COLMAP model (images.bin or");
}

}  // namespace
}  // namespace vggtcd
