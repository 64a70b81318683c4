// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/colmap.h"

#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <cmath>

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
  expect("cameras.txt", "# c\n1 pin-hole 640 480 500\n",
         "cameras.txt:2: expected the name of a COLMAP camera model");
  expect("cameras.txt", "", "expected a camera 1 for image 3, found none");
  expect("images.txt", "1 1 0 0 0 0 0 0 1\n", "images.txt:1: expected at least 10 words");
  expect("images.txt", "1 1 0 0 0 0 nan 0 1 a.jpg\n", "images.txt:1: expected a number, found nan");
  expect("images.txt", "1 1 0 0 0 0 1.7e308 0 1 a.jpg\n",
         "images.txt:1: expected coordinates from -1e13 to 1e13, found 1.7e308");
  expect("images.txt", "1 1 0 0 0 0 0,5 0 1 a.jpg\n",
         "images.txt:1: expected a number with a decimal point, found 0,5");
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

// A binary model of one image "before/a.jpg" whose camera has this model and number of parameters.
void write_camera_model(const TemporaryDirectory& directory, int32_t model_id, size_t num_params) {
  const auto bytes_of = [](auto value) {
    return std::string(reinterpret_cast<const char*>(&value), sizeof(value));
  };
  std::string cameras = bytes_of(uint64_t{1}) + bytes_of(uint32_t{5}) + bytes_of(model_id) +
                        bytes_of(uint64_t{640}) + bytes_of(uint64_t{480});
  for (size_t i = 0; i < num_params; ++i) cameras += bytes_of(100.0 + static_cast<double>(i));
  std::string images = bytes_of(uint64_t{1}) + bytes_of(uint32_t{9});
  for (const double value : {1.0, 0.0, 0.0, 0.0, 1.0, 2.0, 3.0}) images += bytes_of(value);
  images += bytes_of(uint32_t{5}) + std::string("before/a.jpg") + '\0' + bytes_of(uint64_t{0});
  write_bytes(directory / "cameras.bin", cameras);
  write_bytes(directory / "images.bin", images);
}

TEST(ReadColmap, KnowsTheCameraModelsOfNewerVersions) {
  const struct {
    int32_t id;
    size_t params;
    const char* name;
  } models[] = {{10, 12, "THIN_PRISM_FISHEYE"},
                {11, 16, "RAD_TAN_THIN_PRISM_FISHEYE"},
                {12, 4, "SIMPLE_DIVISION"},
                {13, 5, "DIVISION"},
                {14, 3, "SIMPLE_FISHEYE"},
                {15, 4, "FISHEYE"},
                {16, 6, "EUCM"}};
  for (const auto& model : models) {
    const TemporaryDirectory directory;
    write_camera_model(directory, model.id, model.params);
    const ColmapModel read = read_colmap(directory.path());
    EXPECT_EQ(read.cameras.at(5).model, model.name);
    EXPECT_EQ(read.cameras.at(5).params.size(), model.params);
    EXPECT_INPUT_ERROR(colmap_views(read), "run colmap image_undistorter");
  }
}

TEST(ReadColmap, PosesNeedNoKnownCameraModel) {
  const TemporaryDirectory directory;
  write_camera_model(directory, 99, 7);
  const Trajectory trajectory = read_colmap_trajectory(directory.path());
  ASSERT_EQ(trajectory.size(), 1u);
  EXPECT_EQ(trajectory[0].name, "before/a.jpg");
  EXPECT_EQ(trajectory[0].camera_from_world.translation, Eigen::Vector3d(1, 2, 3));
  EXPECT_INPUT_ERROR(read_colmap(directory.path()),
                     "cameras.bin: expected camera models from 0 to 16, found 99; convert");
  // In text every camera has a line of its own.
  const TemporaryDirectory text;
  write_bytes(text / "cameras.txt", "1 NEW_MODEL 640 480 1 2 3 4 5 6 7\n");
  write_bytes(text / "images.txt", "1 1 0 0 0 0 0 0 1 a.jpg\n\n");
  EXPECT_EQ(read_colmap(text.path()).cameras.at(1).params.size(), 7u);
}

TEST(ReadColmap, ImagesComeInNaturalOrderOfTheirNames) {
  const TemporaryDirectory directory;
  std::string images;
  for (const int number : {1, 10, 11, 2, 9}) {
    images += fmt::format("{} 1 0 0 0 0 0 0 1 after/frame_{}.jpg\n\n", 100 - number, number);
  }
  write_bytes(directory / "images.txt", images);
  std::vector<std::string> names;
  for (const NamedPose& pose : read_colmap_trajectory(directory.path())) names.push_back(pose.name);
  EXPECT_THAT(names, ElementsAre("after/frame_1.jpg", "after/frame_2.jpg", "after/frame_9.jpg",
                                 "after/frame_10.jpg", "after/frame_11.jpg"));
}

TEST(ReadColmap, ByteOrderMarksPlusSignsAndCarriageReturnsAreNoErrors) {
  const TemporaryDirectory directory;
  write_bytes(directory / "images.txt",
              "\xef\xbb\xbf# x\r\n1 +1 0 0 0 +0.5 -2 0 1 a b.jpg\r\n\r\n");
  const Trajectory trajectory = read_colmap_trajectory(directory.path());
  ASSERT_EQ(trajectory.size(), 1u);
  EXPECT_EQ(trajectory[0].name, "a b.jpg");
  EXPECT_EQ(trajectory[0].camera_from_world.translation, Eigen::Vector3d(0.5, -2, 0));
}

TEST(ReadColmap, RefusesBinaryCoordinatesThatMeanNothing) {
  const TemporaryDirectory directory;
  for (const double value : {1e308, -1e14, static_cast<double>(NAN)}) {
    write_camera_model(directory, 1, 4);
    std::string images = file_bytes(directory / "images.bin");
    images.replace(8 + 4 + 4 * 8, 8, std::string(reinterpret_cast<const char*>(&value), 8));
    write_bytes(directory / "images.bin", images);
    EXPECT_INPUT_ERROR(read_colmap(directory.path()),
                       "images.bin: expected coordinates from -1e13 to 1e13, found");
  }
}

// COLMAP's own reader takes a name in images.txt up to the first space, and prefers binary files.
TEST(WriteColmap, AddsTheBinaryFormWhereANameHasASpace) {
  std::vector<View> views = two_views();
  const TemporaryDirectory with_space;
  write_colmap(with_space.path(), views);
  EXPECT_EQ(with_space.num_files(), 6u);
  EXPECT_EQ(read_colmap(with_space.path()).images.at(2).name, "before/one two.jpg");
  views[1].name = "before/one_two.jpg";
  const TemporaryDirectory without;
  write_colmap(without.path(), views);
  EXPECT_EQ(without.num_files(), 3u);
}

TEST(ReadColmap, SaysWhatIsMissing) {
  const TemporaryDirectory directory;
  std::filesystem::create_directory(directory / "images.bin");
  EXPECT_INPUT_ERROR(read_colmap_trajectory(directory.path()),
                     "images.bin: expected a file of a COLMAP model, found a directory");
  EXPECT_INPUT_ERROR(read_colmap(directory.path()),
                     "cameras.bin: expected a file of a COLMAP model");
  std::filesystem::remove(directory / "images.bin");
  EXPECT_INPUT_ERROR(read_colmap(directory.path()), "expected a COLMAP model (images.bin or");
}

}  // namespace
}  // namespace vggtcd
