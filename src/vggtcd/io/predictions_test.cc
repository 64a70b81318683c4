// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/predictions.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "tests/support/test_files.h"
#include "vggtcd/io/npz.h"
#include "vggtcd/scene/point_cloud.h"

namespace vggtcd {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr size_t kFrames = 4, kHeight = 6, kWidth = 8, kPixels = kFrames * kHeight * kWidth;

// Arrays by key, from a golden file or made up, to change one and save.
struct Arrays {
  std::vector<std::string> keys{};
  std::vector<std::vector<int64_t>> shapes{};
  std::vector<std::vector<float>> values{};

  static Arrays vggt() {
    const NpzReader npz(source_file("tests/golden/npz/vggt.npz"));
    Arrays arrays;
    for (const char* key : {"extrinsic", "intrinsic", "depth", "depth_conf", "images",
                            "world_points", "world_points_from_depth"}) {
      arrays.set(key, npz.header(key).shape, npz.read<float>(key));
    }
    return arrays;
  }
  size_t find(const std::string& key) const {
    return static_cast<size_t>(std::find(keys.begin(), keys.end(), key) - keys.begin());
  }
  void set(const std::string& key, std::vector<int64_t> shape, std::vector<float> array) {
    remove(key);
    keys.push_back(key), shapes.push_back(std::move(shape)), values.push_back(std::move(array));
  }
  void remove(const std::string& key) {
    const auto at = static_cast<std::ptrdiff_t>(find(key));
    if (static_cast<size_t>(at) == keys.size()) return;
    keys.erase(keys.begin() + at), shapes.erase(shapes.begin() + at);
    values.erase(values.begin() + at);
  }
  std::vector<float>& operator[](const std::string& key) { return values.at(find(key)); }
  void save(const std::filesystem::path& path) const {
    NpzWriter npz(path);
    for (size_t i = 0; i < keys.size(); ++i) npz.add<float>(keys[i], shapes[i], values[i]);
    npz.finish();
  }
};

struct Fixture {
  TemporaryDirectory directory{};
  RecordingProgress progress{};
  Reconstruction read(const Arrays& arrays, const PredictionLimits& limits = {}) {
    arrays.save(directory / "t1.npz");
    return read_reconstruction(directory / "t1.npz", progress, limits);
  }
};

// Points, depth, colour and confidence against what numpy computed in double precision. The file
// has f32 poses and depths of size 10 and below, so points agree to 1e-5; half precision to 1e-2.
void expect_truth(const Reconstruction& r, double tolerance) {
  const NpzReader truth(source_file("tests/golden/npz/truth.npz"));
  const std::vector<double> points = truth.read<double>("points");
  const std::vector<double> confidence = truth.read<double>("confidence");
  ASSERT_EQ(r.num_pixels(), kPixels);
  EXPECT_EQ(r.width, 8);
  EXPECT_EQ(r.height, 6);
  EXPECT_EQ(r.color, truth.read<uint8_t>("image"));
  for (uint32_t pixel = 0; pixel < kPixels; ++pixel) {
    EXPECT_NEAR(r.confidence[pixel], confidence[pixel], tolerance);
    if (r.depth[pixel] == 0) continue;
    const Eigen::Vector3d expected(points[3 * pixel], points[3 * pixel + 1], points[3 * pixel + 2]);
    EXPECT_LT((unproject_pixel(r, pixel).cast<double>() - expected).norm(), tolerance) << pixel;
  }
}

size_t without_depth(const Reconstruction& r) {
  return static_cast<size_t>(std::count(r.depth.begin(), r.depth.end(), 0.0f));
}

TEST(ReadReconstruction, UnderstandsVggt) {
  RecordingProgress progress;
  const Reconstruction r = read_reconstruction(source_file("tests/golden/npz/vggt.npz"), progress);
  expect_truth(r, 1e-5);
  EXPECT_EQ(without_depth(r), 0u);
  EXPECT_THAT(progress.notices, ElementsAre());
  EXPECT_EQ(r.views[3].name, "frame_000003");
}

TEST(ReadReconstruction, UnderstandsHalfPrecision) {
  RecordingProgress progress;
  expect_truth(read_reconstruction(source_file("tests/golden/npz/vggt_half.npz"), progress), 2e-2);
  EXPECT_THAT(progress.notices, ElementsAre());
}

TEST(ReadReconstruction, UnderstandsMapAnythingWorldFromCameraAndItsMask) {
  RecordingProgress progress;
  const Reconstruction r =
      read_reconstruction(source_file("tests/golden/npz/mapanything.npz"), progress);
  expect_truth(r, 1e-5);
  EXPECT_EQ(without_depth(r), 2u);  // frame 1, row 2, columns 3 and 4
  EXPECT_EQ(r.depth[1 * 48 + 2 * 8 + 3], 0.0f);
  EXPECT_THAT(progress.notices, ElementsAre());
}

TEST(ReadReconstruction, UnderstandsDepthAnything3) {
  RecordingProgress progress;
  const Reconstruction r =
      read_reconstruction(source_file("tests/golden/npz/depth_anything_3.npz"), progress);
  expect_truth(r, 1e-5);
  EXPECT_EQ(without_depth(r), 0u);
  EXPECT_THAT(progress.notices, ElementsAre());
}

TEST(ReadReconstruction, ReadsBackWhatWasWritten) {
  Fixture f;
  Reconstruction r = read_reconstruction(source_file("tests/golden/npz/vggt.npz"), f.progress);
  r.views[2].name = "Straße 2.jpg";
  write_reconstruction(f.directory / "w.npz", r);
  const Reconstruction back = read_reconstruction(f.directory / "w.npz", f.progress);
  EXPECT_EQ(back.depth, r.depth);
  EXPECT_EQ(back.confidence, r.confidence);
  EXPECT_EQ(back.color, r.color);
  EXPECT_EQ(back.views[2].name, "Straße 2.jpg");
  expect_truth(back, 1e-5);
}

// A file of the golden scene with its origin moved, poses and points as doubles or floats.
void write_moved(const std::filesystem::path& path, const Eigen::Vector3d& by, bool doubles) {
  RecordingProgress progress;
  const NpzReader npz(source_file("tests/golden/npz/vggt.npz"));
  std::vector<double> poses = npz.read<double>("extrinsic");
  for (size_t i = 0; i < kFrames; ++i) {
    Eigen::Map<Eigen::Matrix<double, 3, 4, Eigen::RowMajor>> pose(poses.data() + 12 * i);
    pose.col(3) -= pose.leftCols<3>() * by;
  }
  std::vector<double> points = npz.read<double>("world_points_from_depth");
  for (size_t i = 0; i < points.size(); ++i) points[i] += by[static_cast<Eigen::Index>(i % 3)];
  const std::vector<float> depth = npz.read<float>("depth"),
                           intrinsics = npz.read<float>("intrinsic"),
                           poses_f32(poses.begin(), poses.end()),
                           points_f32(points.begin(), points.end());
  NpzWriter moved(path);
  const std::vector<int64_t> pose_shape = npz.header("extrinsic").shape,
                             point_shape = npz.header("world_points_from_depth").shape;
  if (doubles) {
    moved.add<double>("extrinsic", pose_shape, poses);
    moved.add<double>("world_points_from_depth", point_shape, points);
  } else {
    moved.add<float>("extrinsic", pose_shape, poses_f32);
    moved.add<float>("world_points_from_depth", point_shape, points_f32);
  }
  moved.add<float>("intrinsic", npz.header("intrinsic").shape, intrinsics);
  moved.add<float>("depth", npz.header("depth").shape, depth);
  moved.finish();
}

TEST(ReadReconstruction, AnOriginFarAwayLosesNothing) {
  Fixture f;
  const Reconstruction near =
      read_reconstruction(source_file("tests/golden/npz/vggt.npz"), f.progress);
  const Eigen::Vector3d far(691234.375, 5334321.75, 512.25);
  write_moved(f.directory / "far.npz", far, true);
  const Reconstruction r = read_reconstruction(f.directory / "far.npz", f.progress);
  EXPECT_GT(r.origin_in_world.x(), 6.9e5);
  for (const auto& notice : f.progress.notices) EXPECT_THAT(notice, Not(HasSubstr("bit numbers")));
  for (uint32_t pixel = 0; pixel < kPixels; pixel += 7) {
    const Eigen::Vector3d in_world = r.origin_in_world + unproject_pixel(r, pixel).cast<double>();
    EXPECT_LT((in_world - far - unproject_pixel(near, pixel).cast<double>()).norm(), 1e-5) << pixel;
  }
  // What we write has the file's origin again.
  write_reconstruction(f.directory / "back.npz", r);
  const Reconstruction back = read_reconstruction(f.directory / "back.npz", f.progress);
  EXPECT_EQ(back.origin_in_world, r.origin_in_world);
  EXPECT_LT((back.views[1].camera_from_world.translation - r.views[1].camera_from_world.translation)
                .norm(),
            1e-8);
}

TEST(ReadReconstruction, SaysWhenTheDigitsOfPosesEndTooEarly) {
  Fixture f;
  write_moved(f.directory / "far.npz", {691234.375, 5334321.75, 512.25}, false);
  read_reconstruction(f.directory / "far.npz", f.progress);
  EXPECT_THAT(f.progress.notices, testing::Contains(HasSubstr("extrinsic: 32-bit numbers")));
}

TEST(ReadReconstruction, OneDepthFarFromAllOthersIsDroppedWithANotice) {
  Fixture f;
  Arrays arrays = Arrays::vggt();
  arrays["depth"][7] = 1e30f;
  const Reconstruction r = f.read(arrays);
  EXPECT_EQ(r.depth[7], 0);
  EXPECT_EQ(without_depth(r), 1u);
  EXPECT_THAT(f.progress.notices,
              ElementsAre(HasSubstr("t1.npz: 1 of 192 pixels are ignored: their depth is far")));
}

// The inverse of each pose, kept as [S, 3, 4].
void invert_poses(Arrays& arrays) {
  std::vector<float>& poses = arrays["extrinsic"];
  for (size_t i = 0; i < kFrames; ++i) {
    Eigen::Map<Eigen::Matrix<float, 3, 4, Eigen::RowMajor>> pose(poses.data() + 12 * i);
    const Eigen::Matrix3f rotation = pose.leftCols<3>().transpose();
    pose.col(3) = (-rotation * pose.col(3)).eval();
    pose.leftCols<3>() = rotation;
  }
}

TEST(ReadReconstruction, RefusesPosesThatTheWorldPointsContradict) {
  Fixture f;
  Arrays arrays = Arrays::vggt();
  invert_poses(arrays);
  EXPECT_INPUT_ERROR(f.read(arrays),
                     "t1.npz: extrinsic: expected camera-from-world poses, but "
                     "world_points_from_depth agrees with world-from-camera");
  // The separate head's points, good to about a percent, tell as well.
  arrays.remove("world_points_from_depth");
  EXPECT_INPUT_ERROR(f.read(arrays), "but world_points agrees with world-from-camera");
  // Without any there is nothing to tell from.
  arrays.remove("world_points");
  EXPECT_EQ(f.read(arrays).num_frames(), 4);
}

TEST(ReadReconstruction, RefusesSquarePosesThatAreCameraFromWorld) {
  Fixture f;
  Arrays arrays = Arrays::vggt();
  const std::vector<float> poses = arrays["extrinsic"];
  std::vector<float> square;
  for (size_t i = 0; i < kFrames; ++i) {
    square.insert(square.end(), poses.data() + 12 * i, poses.data() + 12 * i + 12);
    square.insert(square.end(), {0, 0, 0, 1});
  }
  arrays.set("extrinsic", {4, 4, 4}, square);
  EXPECT_INPUT_ERROR(f.read(arrays), "expected world-from-camera poses");
}

TEST(ReadReconstruction, PointsThatFitNeitherAreRefusedIfExactAndNoticedIfNot) {
  Fixture f;
  Arrays arrays = Arrays::vggt();
  for (float& x : arrays["world_points_from_depth"]) x = -3 * x + 1;
  for (float& x : arrays["world_points"]) x = -3 * x + 1;
  EXPECT_INPUT_ERROR(f.read(arrays), "expected points computed from depth, but");
  arrays.remove("world_points_from_depth");
  f.read(arrays);
  ASSERT_EQ(f.progress.notices.size(), 1u);
  EXPECT_THAT(f.progress.notices[0], HasSubstr("the poses could not be verified"));
}

TEST(ReadReconstruction, InvalidDepthIsNoDepthWithOneNotice) {
  Fixture f;
  Arrays arrays = Arrays::vggt();
  arrays["depth"][0] = std::numeric_limits<float>::quiet_NaN();
  arrays["depth"][1] = std::numeric_limits<float>::infinity();
  arrays["depth"][2] = -1;
  arrays["depth"][3] = 0;  // says itself that there is none
  arrays["depth_conf"][4] = std::numeric_limits<float>::quiet_NaN();
  arrays["depth_conf"][5] = std::numeric_limits<float>::infinity();  // the best there is
  const Reconstruction r = f.read(arrays);
  EXPECT_EQ(without_depth(r), 5u);
  EXPECT_THAT(f.progress.notices,
              ElementsAre(HasSubstr("t1.npz: 4 of 192 pixels are ignored: depth is NaN, infinite "
                                    "or negative in 3, confidence is NaN in 1")));
  EXPECT_GT(r.depth[5], 0);
  EXPECT_EQ(*std::max_element(r.confidence.begin(), r.confidence.end()), r.confidence[5]);
  for (const float confidence : r.confidence) EXPECT_TRUE(std::isfinite(confidence));
}

TEST(ReadReconstruction, FramesWithoutDepthAreNamedAndAFileWithoutIsRefused) {
  Fixture f;
  Arrays arrays = Arrays::vggt();
  std::vector<float>& depth = arrays["depth"];
  std::fill(depth.begin() + 48, depth.begin() + 96, -1.0f);
  const Reconstruction r = f.read(arrays);
  EXPECT_EQ(r.num_frames(), 4);
  EXPECT_THAT(f.progress.notices,
              ElementsAre(HasSubstr("48 of 192"), HasSubstr("are skipped: frame_000001")));
  std::fill(depth.begin(), depth.end(), std::numeric_limits<float>::quiet_NaN());
  EXPECT_INPUT_ERROR(f.read(arrays), "depth: expected positive numbers, found none in any of 4");
}

TEST(ReadReconstruction, MissingImagesAreGreyAndMissingConfidenceConstant) {
  Fixture f;
  Arrays arrays = Arrays::vggt();
  arrays.remove("images");
  arrays.remove("depth_conf");
  const Reconstruction r = f.read(arrays);
  EXPECT_EQ(r.color, std::vector<uint8_t>(3 * kPixels, 128));
  EXPECT_EQ(r.confidence, std::vector<float>(kPixels, 1.0f));
  EXPECT_THAT(f.progress.notices, ElementsAre(HasSubstr("no confidence"), HasSubstr("no images")));
}

TEST(ReadReconstruction, WrongShapesAndCountsAreNamed) {
  const auto expect = [](const char* key, std::vector<int64_t> shape, std::string_view message) {
    Fixture f;
    Arrays arrays = Arrays::vggt();
    size_t size = 1;
    for (const int64_t s : shape) size *= static_cast<size_t>(s);
    std::vector<float> values = arrays[key];
    values.resize(size, 1.0f);
    arrays.set(key, shape, values);
    EXPECT_INPUT_ERROR(f.read(arrays), message);
  };
  expect("depth", {4, 6, 8, 2},
         "depth: expected shape [S, H, W] or [S, H, W, 1], found [4, 6, 8, 2]");
  expect("depth", {192}, "depth: expected shape");
  expect("depth", {4, 0, 8}, "depth: expected shape");
  expect("extrinsic", {3, 3, 4}, "extrinsic: expected shape [4, 3, 4], found [3, 3, 4]");
  expect("extrinsic", {5, 4, 4}, "extrinsic: expected shape [4, 4, 4], found [5, 4, 4]");
  expect("intrinsic", {3, 3, 3}, "intrinsic: expected shape [4, 3, 3], found [3, 3, 3]");
  expect("depth_conf", {4, 8, 6}, "depth_conf: expected shape [4, 6, 8], found [4, 8, 6]");
  expect("images", {4, 3, 8, 6}, "images: expected shape [4, 6, 8, 3], found [4, 3, 8, 6]");
  expect("world_points_from_depth", {4, 6, 8}, "world_points_from_depth: expected shape");
}

TEST(ReadReconstruction, WrongValuesAreNamed) {
  const auto expect = [](const char* key, size_t index, float value, std::string_view message) {
    Fixture f;
    Arrays arrays = Arrays::vggt();
    arrays[key][index] = value;
    EXPECT_INPUT_ERROR(f.read(arrays), message);
  };
  expect("extrinsic", 12, 2.0f, "extrinsic: frame 1: expected a rotation");
  expect("extrinsic", 27, 1e20f, "extrinsic: frame 2: expected coordinates from -1e13 to 1e13");
  expect("intrinsic", 9, -5.0f, "intrinsic: frame 1: expected fx 0 cx");
  expect("intrinsic", 8, 0.0f, "intrinsic: frame 0: expected fx 0 cx");
  expect("images", 3, 200.0f, "images: expected values in [0, 1], found 200");
}

// Frames that tracking lost have NaN or infinity for a pose (ScanNet: -inf in all of it).
void lose_frame(Arrays& arrays, size_t frame) {
  std::fill_n(arrays["extrinsic"].begin() + static_cast<std::ptrdiff_t>(12 * frame), 12,
              -std::numeric_limits<float>::infinity());
}

TEST(ReadReconstruction, FramesWithoutAFinitePoseAreLeftOutAndNamed) {
  Fixture f;
  Arrays arrays = Arrays::vggt();
  lose_frame(arrays, 1);
  arrays["intrinsic"][9 * 3] = NAN;  // of frame 3
  const Reconstruction whole =
      read_reconstruction(source_file("tests/golden/npz/vggt.npz"), f.progress);
  const Reconstruction r = f.read(arrays);
  EXPECT_THAT(r.left_out, ElementsAre(1, 3));
  EXPECT_THAT(f.progress.notices,
              ElementsAre(HasSubstr("are left out: frame_000001, frame_000003")));
  ASSERT_EQ(r.num_frames(), 2);
  for (const int frame : {0, 1}) {
    const int number = 2 * frame;
    EXPECT_EQ(r.number_of_frame(frame), number);
    EXPECT_EQ(r.frame_of_number(number), frame);
    EXPECT_EQ(r.views[static_cast<size_t>(frame)].name,
              whole.views[static_cast<size_t>(number)].name);
    EXPECT_TRUE(std::ranges::equal(r.frame_depth(frame), whole.frame_depth(number)));
    EXPECT_TRUE(std::ranges::equal(r.frame_confidence(frame), whole.frame_confidence(number)));
    EXPECT_TRUE(std::ranges::equal(r.frame_color(frame), whole.frame_color(number)));
  }
  EXPECT_EQ(r.frame_of_number(1), std::nullopt);
  EXPECT_EQ(r.frame_of_number(4), std::nullopt);
  EXPECT_EQ(find_frame(r, "2"), 1);  // a number is the file's
  EXPECT_EQ(find_frame(r, "3"), std::nullopt);
  EXPECT_EQ(find_frame(r, "frame_000002"), 1);
}

TEST(ReadReconstruction, TooFewFramesWithAPoseAreDegenerate) {
  Fixture f;
  Arrays arrays = Arrays::vggt();
  for (const size_t frame : {size_t{0}, size_t{1}, size_t{3}}) lose_frame(arrays, frame);
  EXPECT_ERROR(f.read(arrays), ErrorCode::kDegenerate,
               "expected at least 2 frames with finite poses and intrinsics, found 1 of 4");
  lose_frame(arrays, 2);
  EXPECT_ERROR(f.read(arrays), ErrorCode::kDegenerate, "found 0 of 4");
}

TEST(ReadReconstruction, IntrinsicsOfAnotherPictureSizeAreRefused) {
  const auto scaled = [](double x, double y, size_t frames) {
    Arrays arrays = Arrays::vggt();
    for (size_t i = 0; i < frames; ++i) {
      float* k = arrays["intrinsic"].data() + 9 * i;
      for (const size_t at : {size_t{0}, size_t{2}}) k[at] *= static_cast<float>(x);
      for (const size_t at : {size_t{4}, size_t{5}}) k[at] *= static_cast<float>(y);
    }
    return arrays;
  };
  Fixture f;
  EXPECT_INPUT_ERROR(f.read(scaled(20, 20, kFrames)),
                     "t1.npz: intrinsic: expected intrinsics in pixels of the frames of 8 x 6");
  EXPECT_INPUT_ERROR(f.read(scaled(20, 20, kFrames)),
                     "outside of the frame, and so in every frame");
  // Shares of the width and height, in frames that are no few pixels.
  Arrays shares;
  shares.set("extrinsic", {2, 3, 4}, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0,  //
                                      1, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0});
  shares.set("intrinsic", {2, 3, 3},
             {0.8f, 0, 0.5f, 0, 1.1f, 0.5f, 0, 0, 1,  //
              0.8f, 0, 0.5f, 0, 1.1f, 0.5f, 0, 0, 1});
  shares.set("depth", {2, 12, 16}, std::vector<float>(2 * 12 * 16, 1));
  EXPECT_INPUT_ERROR(f.read(shares), "(0.5, 0.5) in the corner pixel of the frame");
  // One frame that was cut off centre may be right. The points are of the others' cameras.
  Arrays cropped = scaled(20, 20, 1);
  cropped.remove("world_points"), cropped.remove("world_points_from_depth");
  EXPECT_EQ(f.read(cropped).num_frames(), 4);
}

TEST(ReadReconstruction, RefusesAMirroredPose) {
  Fixture f;
  Arrays arrays = Arrays::vggt();
  for (size_t i = 0; i < 3; ++i) arrays["extrinsic"][4 * i] *= -1;
  EXPECT_INPUT_ERROR(f.read(arrays), "expected a rotation");
}

TEST(ReadReconstruction, OtherFilesAreRefusedWithTheKeysTheyHave) {
  EXPECT_INPUT_ERROR(
      read_reconstruction(source_file("tests/golden/npz/truth.npz"), silent_progress()),
      "expected predictions with an array extrinsic (VGGT, MapAnything) or extrinsics "
      "(Depth Anything 3), found points, camera_from_world");
  Fixture f;
  Arrays arrays = Arrays::vggt();
  arrays.remove("depth");
  EXPECT_INPUT_ERROR(f.read(arrays), "expected an array depth, found extrinsic");
}

TEST(ReadReconstruction, AMessageNamesSomeOfManyArrays) {
  Fixture f;
  Arrays arrays;
  for (int i = 0; i < 30; ++i) arrays.set("a" + std::to_string(i), {1}, {0});
  EXPECT_INPUT_ERROR(f.read(arrays), "found a0, a1, a2");
  EXPECT_INPUT_ERROR(f.read(arrays), "a18, a19 and 10 more");
}

TEST(ReadReconstruction, WrongTypesAreNamed) {
  Fixture f;
  Arrays arrays = Arrays::vggt();
  const std::vector<int64_t> depth(kPixels, 1);
  NpzWriter npz(f.directory / "t1.npz");
  npz.add<float>("extrinsic", {4, 3, 4}, arrays["extrinsic"]);
  npz.add<float>("intrinsic", {4, 3, 3}, arrays["intrinsic"]);
  npz.add<int64_t>("depth", {4, 6, 8}, depth);
  npz.finish();
  EXPECT_INPUT_ERROR(read_reconstruction(f.directory / "t1.npz", f.progress),
                     "t1.npz: depth: expected floating-point numbers, found type <i8");
}

TEST(ReadReconstruction, TooFewFramesAreDegenerate) {
  for (const size_t frames : {size_t{0}, size_t{1}}) {
    Fixture f;
    Arrays arrays = Arrays::vggt();
    for (size_t i = 0; i < arrays.keys.size(); ++i) {
      arrays.values[i].resize(arrays.values[i].size() / kFrames * frames);
      arrays.shapes[i][0] = static_cast<int64_t>(frames);
    }
    EXPECT_ERROR(f.read(arrays), ErrorCode::kDegenerate,
                 "expected at least 2 frames, found " + std::to_string(frames));
    if (frames == 0) continue;
    EXPECT_EQ(f.read(arrays, {.min_frames = 1}).num_frames(), 1);
  }
}

TEST(ReadReconstruction, NamesLoseDirectoriesAndMustBeDistinctAndAreElseKeptToTheByte) {
  const auto names_of = [](std::vector<std::string> names) {
    Fixture f;
    const Arrays arrays = Arrays::vggt();
    NpzWriter npz(f.directory / "t1.npz");
    for (size_t i = 0; i < arrays.keys.size(); ++i) {
      npz.add<float>(arrays.keys[i], arrays.shapes[i], arrays.values[i]);
    }
    npz.add_strings("names", names);
    npz.finish();
    std::vector<std::string> result;
    for (const View& view : read_reconstruction(f.directory / "t1.npz", f.progress).views) {
      result.push_back(view.name);
    }
    return result;
  };
  EXPECT_THAT(names_of({"x/a.jpg", "../../b.jpg", "C:\\c.jpg", "d\n.jpg"}),
              ElementsAre("a.jpg", "b.jpg", "c.jpg", "d\n.jpg"));
  const std::vector<std::string> unusual = {"caf\xe9.jpg", "\x1b[31m.jpg", "caf\xc3\xa9.jpg",
                                            "a\\b"};
  EXPECT_EQ(names_of(unusual), unusual);
  const std::vector<std::string> one_stem = {"a.jpg", "a.png", "c", "d"};
  EXPECT_EQ(names_of(one_stem), one_stem);
  const std::vector<std::string> longest = {std::string(251, 'x') + ".jpg", "b", "c", "d"};
  EXPECT_EQ(names_of(longest), longest);
  const auto numbered = ElementsAre("frame_000000", "frame_000001", "frame_000002", "frame_000003");
  EXPECT_THAT(names_of({"x/a.jpg", "y/a.jpg", "b.jpg", "c.jpg"}), numbered);
  EXPECT_THAT(names_of({"a", "b", "..", "d"}), numbered);
  EXPECT_THAT(names_of({"a\n.jpg", "a\\x0a.jpg", "c", "d"}), numbered);  // one as names of files
  EXPECT_THAT(names_of({std::string(252, 'x') + ".jpg", "b", "c", "d"}), numbered);
}

// Two epochs of four frames and a joint file with two keyframes of each.
struct JointFixture : Fixture {
  Reconstruction epoch = read_reconstruction(source_file("tests/golden/npz/vggt.npz"), progress);
  JointReconstruction joint{epoch, {0, 2}, {1, 3}};

  JointReconstruction write_and_read() {
    write_joint(directory / "joint.npz", joint);
    return read_joint(directory / "joint.npz", epoch, epoch, progress);
  }
};

TEST(ReadJoint, ReadsBackWhatWasWritten) {
  JointFixture f;
  const JointReconstruction back = f.write_and_read();
  EXPECT_THAT(back.keyframes_t1, ElementsAre(0, 2));
  EXPECT_THAT(back.keyframes_t2, ElementsAre(1, 3));
  expect_truth(back.reconstruction, 1e-5);
}

TEST(ReadJoint, RefusesKeyframesThatDoNotFit) {
  JointFixture f;
  f.joint.keyframes_t1 = {0, 4};
  EXPECT_INPUT_ERROR(f.write_and_read(),
                     "joint.npz: keyframes_t1: expected frame numbers from 0 to 3, found 4");
  f.joint.keyframes_t1 = {0, -1};
  EXPECT_INPUT_ERROR(f.write_and_read(), "found -1");
  f.joint.keyframes_t1 = {2, 2};
  EXPECT_INPUT_ERROR(f.write_and_read(), "expected distinct frame numbers, found 2, 2");
  f.joint.keyframes_t1 = {0};
  EXPECT_INPUT_ERROR(f.write_and_read(), "expected one frame per keyframe (1 + 2), found 4 frames");
  f.joint.keyframes_t1 = {};
  EXPECT_ERROR(f.write_and_read(), ErrorCode::kDegenerate, "expected keyframes of both epochs");
}

// Joint frames 0 to 3 are T1's frames 0 and 2, T2's 1 and 3 (numbers of the files).
TEST(ReadJoint, KeyframesOfFramesThatWereLeftOutLeave) {
  JointFixture f;
  Reconstruction t1 = f.epoch, t2 = f.epoch;
  remove_frames(t1, {false, true, false, false});  // 0, 2, 3 are left: 2 is the second
  remove_frames(t2, {false, true, false, false});  // keyframe 1 is gone: 3 is the third
  write_joint(f.directory / "joint.npz", f.joint);
  const JointReconstruction joint = read_joint(f.directory / "joint.npz", t1, t2, f.progress);
  EXPECT_THAT(joint.keyframes_t1, ElementsAre(0, 1));
  EXPECT_THAT(joint.keyframes_t2, ElementsAre(2));
  ASSERT_EQ(joint.reconstruction.num_frames(), 3);
  EXPECT_TRUE(std::ranges::equal(joint.reconstruction.frame_depth(2), f.epoch.frame_depth(3)));
}

TEST(ReadJoint, AJointPassThatLostAFrameLosesItsKeyframe) {
  JointFixture f;
  Arrays arrays = Arrays::vggt();
  lose_frame(arrays, 1);
  const std::vector<int64_t> t1{0, 2}, t2{1, 3};
  NpzWriter npz(f.directory / "joint.npz");
  for (size_t i = 0; i < arrays.keys.size(); ++i) {
    npz.add<float>(arrays.keys[i], arrays.shapes[i], arrays.values[i]);
  }
  npz.add<int64_t>("keyframes_t1", {2}, t1);
  npz.add<int64_t>("keyframes_t2", {2}, t2);
  npz.finish();
  const JointReconstruction joint =
      read_joint(f.directory / "joint.npz", f.epoch, f.epoch, f.progress);
  EXPECT_THAT(joint.keyframes_t1, ElementsAre(0));
  EXPECT_THAT(joint.keyframes_t2, ElementsAre(1, 3));
  EXPECT_EQ(joint.reconstruction.num_frames(), 3);
  Reconstruction without = f.epoch;
  remove_frames(without, {true, false, false, false});
  EXPECT_ERROR(read_joint(f.directory / "joint.npz", without, f.epoch, f.progress),
               ErrorCode::kDegenerate, "expected keyframes of both epochs, found 0 and 2");
}

TEST(ReadJoint, RefusesAnEpochFileAndOtherFrameSizes) {
  JointFixture f;
  EXPECT_INPUT_ERROR(
      read_joint(source_file("tests/golden/npz/vggt.npz"), f.epoch, f.epoch, f.progress),
      "expected an array keyframes_t1");
  f.write_and_read();
  Reconstruction other = f.epoch;
  other.width = 9;
  EXPECT_INPUT_ERROR(read_joint(f.directory / "joint.npz", f.epoch, other, f.progress),
                     "expected frames of 9 x 6 as in the after epoch, found 8 x 6");
}

}  // namespace
}  // namespace vggtcd
