// SPDX-License-Identifier: Apache-2.0
// The small pieces between COLMAP's model and depth: reading it, undistorting, choosing neighbours,
// trust, the joint reconstruction.
#include <gmock/gmock.h>

#include <cmath>
#include <cstring>
#include <fstream>

#include "tests/support/test_files.h"
#include "vggtcd/core/error.h"
#include "vggtcd/reconstruction/reconstructor.h"
#include "vggtcd/reconstruction/trust.h"
#include "vggtcd/reconstruction/undistort.h"
#include "vggtcd/reconstruction/view_selection.h"

namespace vggtcd {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

template <typename F>
std::string message_of(ErrorCode code, const F& f) {
  try {
    f();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "not refused";
  return {};
}

// COLMAP's binary files, byte by byte.
class Bytes {
 public:
  template <typename T>
  Bytes& put(T value) {
    text_.append(reinterpret_cast<const char*>(&value), sizeof value);
    return *this;
  }
  Bytes& text(const char* value) {
    text_.append(value, std::strlen(value) + 1);
    return *this;
  }
  void write(const std::filesystem::path& path, size_t cut = 0) const {
    std::ofstream(path, std::ios::binary)
        .write(text_.data(), static_cast<std::streamsize>(text_.size() - cut));
  }

 private:
  std::string text_;
};

std::filesystem::path write_model(int32_t camera_model, size_t cut_points) {
  // Of this process alone: other checkouts may run the same test now.
  static const TemporaryDirectory directory;
  const auto folder = directory / "colmap_model";
  std::filesystem::create_directories(folder);
  Bytes()
      .put<uint64_t>(1)
      .put<uint32_t>(4)
      .put<int32_t>(camera_model)
      .put<uint64_t>(640)
      .put<uint64_t>(480)
      .put(500.0)
      .put(320.0)
      .put(240.0)
      .put(-0.1)
      .write(folder / "cameras.bin");
  Bytes images;
  images.put<uint64_t>(2);
  for (const char* name : {"b.pgm", "a.pgm"}) {
    const bool second = name[0] == 'a';
    // A quarter turn about z, and none.
    images.put<uint32_t>(second ? 9 : 3)
        .put(second ? 1.0 : std::sqrt(0.5))
        .put(0.0)
        .put(0.0)
        .put(second ? 0.0 : std::sqrt(0.5))
        .put(1.0)
        .put(2.0)
        .put(3.0)
        .put<uint32_t>(4)
        .text(name)
        .put<uint64_t>(1)
        .put(10.0)
        .put(20.0)
        .put<uint64_t>(77);
  }
  images.write(folder / "images.bin");
  Bytes()
      .put<uint64_t>(1)
      .put<uint64_t>(77)
      .put(0.5)
      .put(-0.5)
      .put(8.0)
      .put<uint8_t>(0)
      .put<uint8_t>(0)
      .put<uint8_t>(0)
      .put(0.25)
      .put<uint64_t>(3)
      .put<uint32_t>(3)
      .put<uint32_t>(0)
      .put<uint32_t>(9)
      .put<uint32_t>(0)
      .put<uint32_t>(9)
      .put<uint32_t>(1)
      .write(folder / "points3D.bin", cut_points);
  return folder;
}

TEST(ReadColmapModel, ReadsCamerasPosesAndTracksByName) {
  const SfmModel model = read_colmap_model(write_model(2, 0));
  ASSERT_EQ(model.views.size(), 2u);
  EXPECT_EQ(model.views[0].name, "a.pgm");
  EXPECT_EQ(model.views[0].camera.cx, 319.5);  // pixel centres at integers
  EXPECT_EQ(model.views[0].camera.k, -0.1);
  const Eigen::Vector3d turned = model.views[1].camera_from_world * Eigen::Vector3d(1, 0, 0);
  EXPECT_LT((turned - Eigen::Vector3d(1, 3, 3)).norm(), 1e-12);
  ASSERT_EQ(model.points.size(), 1u);
  EXPECT_THAT(model.points[0].views, ElementsAre(0, 1));
}

TEST(ReadColmapModel, RefusesFilesThatEndEarlyAndOtherCameras) {
  for (const size_t cut : {1u, 8u, 30u, 80u}) {
    const auto folder = write_model(2, cut);
    EXPECT_THAT(message_of(ErrorCode::kInput, [&] { read_colmap_model(folder); }),
                HasSubstr("points3D.bin"));
  }
  const auto folder = write_model(4, 0);
  EXPECT_THAT(message_of(ErrorCode::kInput, [&] { read_colmap_model(folder); }),
              HasSubstr("SIMPLE_RADIAL"));
}

// What COLMAP writes when an adjustment diverged is no camera.
TEST(ReadColmapModel, RefusesNumbersThatAreNoCamera) {
  const auto expect = [](const char* file, size_t offset, auto value, const char* part) {
    const auto folder = write_model(2, 0);
    {
      std::fstream out(folder / file, std::ios::in | std::ios::out | std::ios::binary);
      out.seekp(static_cast<std::streamoff>(offset));
      out.write(reinterpret_cast<const char*>(&value), sizeof(value));
    }
    EXPECT_THAT(message_of(ErrorCode::kInput, [&] { read_colmap_model(folder); }),
                ::testing::AllOf(HasSubstr(file), HasSubstr(part)));
  };
  expect("images.bin", 12, 0.1, "expected a unit quaternion, found");
  expect("images.bin", 12, std::nan(""), "expected coordinates from -1e13 to 1e13, found nan");
  expect("images.bin", 12 + 4 * 8, 1e300, "expected coordinates from -1e13 to 1e13, found 1e+300");
  expect("cameras.bin", 16, uint64_t{1} << 40, "expected the side of a photo in px");
  expect("cameras.bin", 16, uint64_t{0}, "expected the side of a photo in px");
  expect("cameras.bin", 32, -500.0, "expected a focal length above 0, found -500");
  expect("points3D.bin", 16, std::nan(""), "expected coordinates");
}

TEST(Undistort, ShowsEveryPointWhereAnIdealCameraWould) {
  // Red and green tell the pixel of the photo they were taken from; 8 bits are two pixels coarse.
  RadialCamera camera{480, 320, 400, 245, 150, -0.15};
  Image photo(480, 320);
  for (int v = 0; v < 320; ++v) {
    for (int u = 0; u < 480; ++u) {
      photo.pixel(u, v)[0] = static_cast<uint8_t>(u / 2);
      photo.pixel(u, v)[1] = static_cast<uint8_t>(v / 2);
    }
  }
  const Pinhole pinhole = covering_pinhole(camera, 240, 154);  // cut above and below by 3 px
  EXPECT_DOUBLE_EQ(pinhole.fx, 200);
  const UndistortedPhoto out = undistort(photo, camera, pinhole);
  int inside = 0;
  for (int v = 0; v < pinhole.height; v += 7) {
    for (int u = 0; u < pinhole.width; u += 7) {
      const Eigen::Vector3d x = pinhole.unproject(u, v, 2.0) / 2.0;
      const double bend = 1 + camera.k * (x.x() * x.x() + x.y() * x.y());
      const double pu = 400 * bend * x.x() + 245, pv = 400 * bend * x.y() + 150;
      const auto i = static_cast<size_t>(v * pinhole.width + u);
      EXPECT_EQ(out.valid[i], pu >= -0.5 && pv >= -0.5 && pu <= 479.5 && pv <= 319.5);
      if (!out.valid[i] || pu < 3 || pv < 3 || pu > 476 || pv > 316) continue;
      ++inside;
      // u / 2 is rounded down (by 0.25 on average), then averaged over 2 x 2 px and interpolated.
      EXPECT_NEAR(out.color.pixel(u, v)[0], pu / 2 - 0.25, 1.0);
      EXPECT_NEAR(out.color.pixel(u, v)[1], pv / 2 - 0.25, 1.0);
    }
  }
  EXPECT_GT(inside, 500);
}

// Cameras on a line looking at points 10 away, all of which all of them see.
SfmResult walk(const std::vector<double>& x_of_camera, int points) {
  SfmResult sfm;
  for (size_t i = 0; i < x_of_camera.size(); ++i) {
    SfmView view;
    view.camera_from_world.translation = {-x_of_camera[i], 0, 0};
    sfm.model.views.push_back(view);
    sfm.photo_of_view.push_back(static_cast<int>(i));
  }
  for (int k = 0; k < points; ++k) {
    SfmPoint point;
    point.x_in_world = {0.01 * k, 0, 10};
    for (size_t i = 0; i < x_of_camera.size(); ++i) point.views.push_back(static_cast<int>(i));
    sfm.model.points.push_back(point);
  }
  return sfm;
}

TEST(PlanDepth, TakesNeighboursOfTheSameEpochUnderGoodAngles) {
  // From camera 0: 0.06 (0.3 degrees) is too near, 20 (63 degrees) too far.
  const SfmResult sfm = walk({0, 0.06, 1.4, 3, 20, 1.4}, 30);
  const auto tasks = plan_depth(sfm.model, {1, 1, 1, 1, 1, 2}, {});
  EXPECT_THAT(tasks[0].sources, ElementsAre(2, 3));  // 8 degrees before 17
  EXPECT_TRUE(tasks[5].sources.empty());
  EXPECT_GT(1 / tasks[0].range.farthest_inverse, 15);
  EXPECT_LT(1 / tasks[0].range.nearest_inverse, 7);
}

TEST(PlanDepth, IgnoresNeighboursWithFewSharedPoints) {
  const auto tasks = plan_depth(walk({0, 1.4}, 11).model, {1, 1}, {});
  EXPECT_TRUE(tasks[0].sources.empty());
}

SfmTrust good_trust() { return {10, 10, 9, 8, 400, 9.0, 0.6}; }

TEST(RequireTrust, PassesAGoodModel) { require_trust(good_trust(), {}); }

TEST(RequireTrust, RefusesEachBoundWithItsReason) {
  const auto refusal = [](auto change) {
    SfmTrust trust = good_trust();
    change(trust);
    return message_of(ErrorCode::kDegenerate, [&] { require_trust(trust, {}); });
  };
  EXPECT_THAT(refusal([](SfmTrust& t) { t.placed_t1 = t.placed_t2 = 0; }),
              HasSubstr("no two of the 20"));
  EXPECT_THAT(refusal([](SfmTrust& t) { t.placed_t2 = 0; }), HasSubstr("same place"));
  EXPECT_THAT(refusal([](SfmTrust& t) { t.placed_t1 = 5; }), HasSubstr("5 of 10 before"));
  EXPECT_THAT(refusal([](SfmTrust& t) { t.photos_t2 = t.placed_t2 = 3; }),
              HasSubstr("3 of 3 after"));
  EXPECT_THAT(refusal([](SfmTrust& t) { t.shared_points = 49; }), HasSubstr("share 49 points"));
  EXPECT_THAT(refusal([](SfmTrust& t) { t.median_angle_deg = 1; }), HasSubstr("sideways"));
  EXPECT_THAT(refusal([](SfmTrust& t) { t.homography_share = 0.97; }), HasSubstr("plane"));
}

TEST(RequireDepth, RefusesAnEpochWhosePhotosAgreeOnTooLittle) {
  require_depth(0.1, "before", {});
  const std::string said =
      message_of(ErrorCode::kDegenerate, [] { require_depth(0.0949, "after", {}); });
  EXPECT_THAT(said, HasSubstr("9 % of the pixels of the after epoch, at least 10 %"));
  EXPECT_THAT(said, HasSubstr("take more photos from closer together"));
}

TEST(MeasureTrust, CountsPhotosPointsAnglesAndPlanes) {
  SfmResult sfm = walk({0, 1, 10}, 1);  // 45 degrees between the first and the last
  sfm.model.points[0].x_in_world = {0, 0, 10};
  sfm.photo_of_view = {0, 2, 4};
  sfm.pairs = {{0, 2, std::vector<Match>(20), 15}, {0, 1, std::vector<Match>(20), 20}};
  const SfmTrust trust = measure_trust(sfm, 3, 2);
  EXPECT_EQ(trust.placed_t1, 2);
  EXPECT_EQ(trust.placed_t2, 1);
  EXPECT_EQ(trust.shared_points, 1);
  EXPECT_NEAR(trust.median_angle_deg, 45, 1e-9);
  EXPECT_DOUBLE_EQ(trust.homography_share, 0.75);  // photo 1 was not placed
}

TEST(JointOfKeyframes, RepeatsTheKeyframesOfBothEpochs) {
  const auto epoch = [](int frames, float depth) {
    Reconstruction r;
    r.width = 2;
    r.height = 1;
    for (int i = 0; i < frames; ++i) {
      r.views.push_back({{}, {1, 1, 0, 0, 2, 1}, std::to_string(i)});
      r.depth.insert(r.depth.end(), {depth + static_cast<float>(i), 0});
    }
    r.confidence = r.depth;
    r.color.resize(r.depth.size() * 3);
    return r;
  };
  const JointReconstruction joint = joint_of_keyframes(epoch(5, 10), epoch(2, 20), 3);
  EXPECT_THAT(joint.keyframes_t1, ElementsAre(0, 2, 4));
  EXPECT_THAT(joint.keyframes_t2, ElementsAre(0, 1));
  EXPECT_THAT(joint.reconstruction.depth, ElementsAre(10, 0, 12, 0, 14, 0, 20, 0, 21, 0));
  EXPECT_EQ(joint.reconstruction.views[1].name, "2");
}

}  // namespace
}  // namespace vggtcd
