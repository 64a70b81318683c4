// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/pipeline/metres.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/test_files.h"
#include "tests/support/toy_scene.h"
#include "vggtcd/pipeline/result_frame.h"

namespace vggtcd {
namespace {

using testing_support::box_relief;
using testing_support::flat_relief;
using testing_support::kT2FromT1;
using testing_support::reconstruct;

// The toy scene is in metres; T1 is its frame, T2 another one.
struct Scene {
  Reconstruction before = reconstruct({.camera_offset = 0, .relief = flat_relief}, Sim3{});
  Reconstruction after = reconstruct({.camera_offset = 0.1, .relief = box_relief}, kT2FromT1);

  Scene() {
    for (int i = 0; i < before.num_frames(); ++i) {
      before.views[static_cast<size_t>(i)].name = fmt::format("{}.jpg", i);
      after.views[static_cast<size_t>(i)].name = fmt::format("{}.jpg", i);
    }
  }
  // Of the surface at a pixel, in the scene.
  static Eigen::Vector3d point(const Reconstruction& epoch, int frame, int x, int y,
                               const Sim3& scene_from_epoch) {
    const size_t pixel =
        static_cast<size_t>(y) * static_cast<size_t>(epoch.width) + static_cast<size_t>(x);
    const View& view = epoch.views[static_cast<size_t>(frame)];
    const double depth = static_cast<double>(epoch.frame_depth(frame)[pixel]);
    return scene_from_epoch *
           (view.camera_from_world.inverse() * view.pinhole.unproject(x, y, depth));
  }
};

Metric solve(const MetricInputs& inputs, const Scene& scene,
             ProgressSink& progress = silent_progress()) {
  return MetricProblem(inputs, scene.before, scene.after, progress)
      .solve(scene.before, scene.after, kT2FromT1, kT2FromT1, 0);
}

TEST(KnownDistance, MayJoinPhotosOfEitherEpoch) {
  const Scene scene;
  const Eigen::Vector3d a = Scene::point(scene.before, 1, 5, 6, {});
  const Eigen::Vector3d b = Scene::point(scene.after, 2, 40, 30, kT2FromT1.inverse());
  const Metric metric = solve({{{"5,6,before/1.jpg", "40,30,after/2", (a - b).norm()}}, {}}, scene);
  // Single-precision points at a depth of about 5 in a frame of scale 1.7.
  EXPECT_NEAR(metric.frame.metres_from_t2.scale, 1 / kT2FromT1.scale, 1e-6);
  EXPECT_NEAR(metric.measured_m.at(0), (a - b).norm(), 1e-5);
}

TEST(KnownDistance, RefusesWhatNamesNoPlaceBeforeAnythingIsComputed) {
  Scene scene;
  const auto one = [](std::string a, std::string b, double metres) {
    return MetricInputs{{{std::move(a), std::move(b), metres}}, {}};
  };
  const auto expect = [&](const MetricInputs& inputs, const char* part) {
    EXPECT_ERROR(MetricProblem(inputs, scene.before, scene.after, silent_progress()),
                 ErrorCode::kUsage, part);
  };
  expect(one("5,6,1.jpg", "9,9,after/2", 1), "--known-distance: expected X,Y,before/PHOTO");
  expect(one("5,6,after/1.png", "9,9,after/2", 1), "--known-distance: no photo \"1.png\"");
  expect(one("500,6,after/1", "9,9,after/2", 1), "outside the photo");
  expect(one("5,6,after/1", "9,9,after/2", 0), "above 0 m");
  expect(one("5,6,after/1", "9,9,after/2", NAN), "above 0 m");
  scene.after
      .depth[scene.after.pixels_per_frame() + 6u * static_cast<size_t>(scene.after.width) + 5u] = 0;
  expect(one("5,6,after/1", "9,9,after/2", 1), "5,6,after/1 has no depth");
  MetricInputs both = one("9,9,after/1", "5,6,after/2", 1);
  both.reference = "cameras.txt";
  expect(both, "expected one of them");
  EXPECT_ERROR(solve(one("9,9,after/1", "9,9,after/1", 1), scene), ErrorCode::kUsage, "one place");
}

TEST(KnownDistance, APixelOnAnEdgeOfDepthIsNoted) {
  Scene scene;
  float* depth = scene.after.depth.data();
  for (int i = 0; i < 12; ++i) depth[10 * scene.after.width + i] *= 1.2f;
  RecordingProgress progress;
  solve({{{"5,10,after/0", "40,30,after/0", 1}}, {}}, scene, progress);
  ASSERT_EQ(progress.notices.size(), 1u);
  EXPECT_NE(progress.notices[0].find("5,10,after/0 lies on an edge"), std::string::npos);
}

// The true frame is that of T1, so the reference gives it back.
std::string table_of(const Scene& scene) {
  std::string table;
  const double heights[] = {0, 0.2, -0.1, 0.3};  // the toy cameras walk along a line
  for (size_t i = 0; i < 4; ++i) {
    const Eigen::Vector3d c = camera_center(scene.before.views[i].camera_from_world);
    table += fmt::format("before/{} {} {} {}\n", scene.before.views[i].name, c.x(),
                         c.y() + heights[i], c.z());
  }
  return table;
}

Scene on_a_curve() {
  Scene scene;
  const double heights[] = {0, 0.2, -0.1, 0.3};
  for (size_t i = 0; i < 4; ++i) {
    Rigid3& pose = scene.before.views[i].camera_from_world;
    const Eigen::Vector3d center = camera_center(pose) + Eigen::Vector3d(0, heights[i], 0);
    pose.translation = -(pose.rotation * center);
  }
  return scene;
}

TEST(Reference, CamerasOfOneEpochGiveTheFrameOfTheTable) {
  const Scene straight, scene = on_a_curve();
  const TemporaryDirectory directory;
  write_bytes(directory / "cameras.txt", table_of(straight) + "other.jpg 1 2 3\n");
  RecordingProgress progress;
  const Metric metric = solve({{}, directory / "cameras.txt"}, scene, progress);
  const Sim3 scene_from_t1 = metric.frame.metres_from_t2 * kT2FromT1;
  EXPECT_NEAR(scene_from_t1.scale, 1, 1e-9);
  EXPECT_LT((scene_from_t1.rotation - Eigen::Matrix3d::Identity()).norm(), 1e-9);
  EXPECT_LT(scene_from_t1.translation.norm(), 1e-9);
  EXPECT_EQ(metric.cameras.at(3), "before/3.jpg");
  ASSERT_EQ(progress.notices.size(), 1u);
  EXPECT_NE(progress.notices[0].find("1 of 5 cameras"), std::string::npos);
}

TEST(Reference, RefusesNamesThatDoNotTellThePhoto) {
  const Scene scene;
  const TemporaryDirectory directory;
  const auto expect = [&](std::string_view table, const char* part) {
    write_bytes(directory / "cameras.txt", table);
    EXPECT_INPUT_ERROR(solve({{}, directory / "cameras.txt"}, scene), part);
  };
  expect("1.jpg 0 0 0\nafter/2.jpg 1 0 0\nafter/3.jpg 0 1 0\n", "a photo of both epochs");
  expect("after/2.jpg 1 0 0\nafter/3.jpg 0 1 0\nx.jpg 4 4 4\n", "found 2; \"x.jpg\" is none");
}

TEST(ResultFrame, MetresAreInNamesAndNumbers) {
  Metric metric;
  metric.frame.metres_from_t2 = {2.0, Eigen::Matrix3d::Identity(), {1, 0, 0}};
  metric.frame.scale_sigma = 0.01;
  metric.cameras = {"after/a.jpg"};
  const ResultFrame frame(metric, Scene().after);
  EXPECT_EQ(frame.name, "reference");
  EXPECT_EQ(frame.key("volume_sigma_u3"), "volume_sigma_m3");
  EXPECT_EQ(frame.key("surface_u2"), "surface_m2");
  EXPECT_EQ(frame.key("points_t2"), "points_t2");
  EXPECT_EQ(frame.renamed(Json{{"a", {{{"gap_u", 1}}}}}).dump(), R"({"a":[{"gap_m":1}]})");

  ChangeSet changes;
  changes.scene_extent_u = 5;
  changes.threshold_u = 0.05;
  changes.t1.score = {0.01f, NAN, 0.06f};
  const TemporaryDirectory directory;
  AnswerStore answers(directory.path());
  const float gaps[] = {-1, NAN, 2}, evidence[] = {1, NAN, 2};
  answers.t1.gap.write(0, gaps);
  answers.t1.level_of_detection.write(0, gaps);
  answers.t1.evidence.write(0, evidence);
  ChangeInstances instances;
  instances.instances.resize(1);
  InstancePart& part = instances.instances[0].after.emplace();
  part.volume_u3 = 1;
  part.volume_sigma_u3 = 0.1;
  part.surface_u2 = 6;
  part.box.center = {1, 2, 3};
  part.box.size = {3, 2, 1};
  std::optional<PixelExplanation> none;
  express(frame, changes, &answers, instances, none);
  EXPECT_EQ(changes.scene_extent_u, 10);
  EXPECT_EQ(changes.t1.score[2], 0.12f);
  EXPECT_TRUE(changes.changed(changes.t1, 2));
  EXPECT_TRUE(std::isnan(changes.t1.score[1]));
  float read[3];
  answers.t1.gap.read(0, read);
  EXPECT_EQ(read[0], -2);
  EXPECT_TRUE(std::isnan(read[1]));
  answers.t1.level_of_detection.read(0, read);
  EXPECT_EQ(read[2], 4);
  answers.t1.evidence.read(0, read);
  EXPECT_EQ(read[2], 2);  // sigmas have no unit
  EXPECT_EQ(part.box.center, Eigen::Vector3d(3, 4, 6));
  EXPECT_EQ(part.box.size, Eigen::Vector3d(6, 4, 2));
  EXPECT_EQ(part.surface_u2, 24);
  EXPECT_DOUBLE_EQ(part.volume_u3, 8);
  EXPECT_DOUBLE_EQ(part.volume_sigma_u3, std::hypot(0.8, 3 * 0.01 * 8));
}

TEST(ResultFrame, AReferenceFarAwayIsWrittenAboutAnOriginNearby) {
  Metric metric;
  metric.frame.metres_from_t2 = {2.0, Eigen::Matrix3d::Identity(), {691234.4, 5334321.3, 100}};
  metric.cameras = {"after/a.jpg"};
  const Scene scene;
  const ResultFrame frame(metric, scene.after);
  ASSERT_TRUE(frame.is_far());
  const Eigen::Vector3d x(0.1, 0.2, 0.3);
  EXPECT_LT((frame.origin + frame.from_t2 * x - metric.frame.metres_from_t2 * x).norm(), 1e-8);
  EXPECT_LT((frame.from_t2 * x).norm(), 100);
  ChangeSet changes;
  ChangeInstances instances;
  instances.instances.resize(1);
  instances.instances[0].after.emplace().box.center = x;
  std::optional<PixelExplanation> none;
  express(frame, changes, nullptr, instances, none);
  EXPECT_LT((instances.instances[0].after->box.center - metric.frame.metres_from_t2 * x).norm(),
            1e-8);
}

TEST(ResultFrame, ALengthScalesAFarFrameAboutItsWorldsOrigin) {
  Metric metric;
  metric.frame.metres_from_t2.scale = 2;
  Scene scene;
  scene.after.origin_in_world = {500000, 4000000, 0};
  const ResultFrame frame(metric, scene.after);
  EXPECT_EQ(frame.origin, Eigen::Vector3d(1000000, 8000000, 0));
  const Sim3 in_files = in_worlds(metric, scene.after.origin_in_world).frame.metres_from_t2;
  EXPECT_LT(in_files.translation.norm(), 1e-9);
  EXPECT_EQ(in_files.scale, 2);
}

TEST(ResultFrame, WithoutMetresNothingChanges) {
  const ResultFrame frame;
  EXPECT_EQ(frame.key("volume_u3"), "volume_u3");
  ChangeSet changes;
  changes.t1.score = {0.1f};
  ChangeInstances instances;
  std::optional<PixelExplanation> none;
  express(frame, changes, nullptr, instances, none);
  EXPECT_EQ(changes.t1.score[0], 0.1f);
}

}  // namespace
}  // namespace vggtcd
