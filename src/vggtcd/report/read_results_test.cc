// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/report/read_results.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/test_files.h"
#include "vggtcd/io/colmap.h"
#include "vggtcd/io/image_write.h"
#include "vggtcd/io/json_file.h"
#include "vggtcd/io/npz.h"
#include "vggtcd/io/ply.h"
#include "vggtcd/report/heat_map.h"

namespace vggtcd {
namespace {

// Results as docs/formats.md describes them: two frames before, three after, 8 x 6 px.
class Results {
 public:
  Results() {
    Json summary = {{"inputs", {{"before", {{"file", "a.npz"}}}, {"after", {{"file", "b.npz"}}}}},
                    {"change", {{"scene_extent_u", 5.0}, {"threshold_u", 0.05}, {"bound_u", 0.1}}}};
    write_json_file(directory / "summary.json", summary);
    std::vector<float> score_t1(2 * 48, 0.02f), score_t2(3 * 48, 0.07f);
    score_t1[5] = NAN;
    NpzWriter npz(directory / "change.npz");
    npz.add<float>("score_t1", {2, 6, 8}, score_t1);
    npz.add<float>("score_t2", {3, 6, 8}, score_t2);
    npz.finish();
    for (const char* name : {"before_aligned.ply", "after.ply"}) {
      PlyWriter ply(directory / name, 2, {"change_distance", "changed", "confidence"});
      for (int i = 0; i < 2; ++i) {
        const uint8_t rgb[] = {10, 20, static_cast<uint8_t>(30 + i)};
        const float values[] = {0.01f * static_cast<float>(i + 1), 0, 1};
        ply.add({static_cast<float>(i), 2, 3}, rgb, values);
      }
      ply.commit();
    }
    std::vector<View> views;
    for (const char* name :
         {"before/z.jpg", "before/a.jpg", "after/3.jpg", "after/2.jpg", "after/1.jpg"}) {
      View view;
      view.name = name;
      view.camera_from_world.translation = {static_cast<double>(views.size()), 0, 0};
      view.pinhole = Pinhole{7, 7.5, 3.5, 2.5, 8, 6};
      views.push_back(view);
    }
    std::filesystem::create_directories(directory / "colmap");
    write_colmap_text(directory / "colmap", views);
    std::filesystem::create_directories(directory / "overlays" / "before");
    std::vector<uint8_t> photo(3 * 48);
    for (size_t i = 0; i < photo.size(); ++i) photo[i] = static_cast<uint8_t>(i);
    const Image overlay = render_overlay(photo, std::vector<float>(48, 0.02f), 6, 8, {0.05, 0.1});
    write_png(directory / "overlays" / "before" / "a.png", overlay);
  }
  TemporaryDirectory directory;
};

TEST(ReadResults, JoinsCamerasScoresAndPointsInFrameOrder) {
  const Results results;
  const ReportInput input = read_results(results.directory.path());
  EXPECT_EQ(input.title, "a.npz → b.npz");
  EXPECT_EQ(input.threshold_u, 0.05);
  ASSERT_EQ(input.before.photos.size(), 2u);
  ASSERT_EQ(input.after.photos.size(), 3u);
  // As written, not by name: photo i belongs to score map i.
  EXPECT_EQ(input.before.photos[0].name, "z.jpg");
  EXPECT_EQ(input.after.photos[2].name, "1.jpg");
  EXPECT_EQ(input.after.photos[2].camera_from_world->translation.x(), 4);
  EXPECT_EQ(input.after.photos[2].pinhole->cx, 3.5);
  EXPECT_TRUE(std::isnan(input.before.score[5]));
  EXPECT_EQ(input.after.score.size(), 144u);
  int blocks = 0;
  input.before.cloud.for_each_block([&](const ReportPoints& points) {
    ++blocks;
    EXPECT_EQ(points.positions[1], Eigen::Vector3f(1, 2, 3));
    EXPECT_EQ(points.color[5], 31);
  });
  input.after.cloud.for_each_block([&](const ReportPoints& points) {
    ++blocks;
    EXPECT_EQ(points.change_distance[1], 0.02f);
  });
  EXPECT_EQ(blocks, 2);
}

TEST(ReadResults, PhotosAreTheLeftPartsOfTheOverlays) {
  const Results results;
  const ReportInput input = read_results(results.directory.path());
  const Image photo = input.before.image(1);
  ASSERT_EQ(photo.width, 8);
  ASSERT_EQ(photo.height, 6);
  for (size_t i = 0; i < photo.rgb.size(); ++i) EXPECT_EQ(photo.rgb[i], i);
  EXPECT_EQ(input.before.image(0).width, 0);  // it has no overlay
}

TEST(ReadResults, TheListOfChangesIsTakenAsItIs) {
  const Results results;
  EXPECT_TRUE(read_results(results.directory.path()).changes.is_null());
  const Json list = Json::array({{{"id", 1}, {"class", "added"}}});
  write_json_file(results.directory / "changes.json", {{"changes", list}});
  EXPECT_EQ(read_results(results.directory.path()).changes, list);
}

TEST(ReadResults, FarFromTheOriginThePageIsDrawnAboutAPlaceNearby) {
  const Results results;
  const Eigen::Vector3d origin(691234, 5334321, 0);
  Json summary = read_json_file(results.directory / "summary.json");
  summary["change"]["origin_u"] = {origin.x(), origin.y(), origin.z()};
  write_json_file(results.directory / "summary.json", summary);
  {
    PlyWriter ply(results.directory / "after.ply", 1, {"change_distance"}, {}, origin);
    const uint8_t rgb[] = {1, 2, 3};
    const float values[] = {0.01f};
    ply.add({0.125f, 2, 3}, rgb, values);
    ply.commit();
  }
  const Json center = {origin.x() + 1.5, origin.y(), 4.0};
  write_json_file(
      results.directory / "changes.json",
      {{"changes", Json::array({{{"center", center}, {"after", {{"center", center}}}}})}});
  const ReportInput input = read_results(results.directory.path());
  EXPECT_EQ(input.origin, origin);
  input.after.cloud.for_each_block([&](const ReportPoints& points) {
    EXPECT_EQ(points.positions[0], Eigen::Vector3f(0.125f, 2, 3));
  });
  EXPECT_EQ(input.changes[0]["center"], Json({1.5, 0.0, 4.0}));
  EXPECT_EQ(input.changes[0]["after"]["center"], Json({1.5, 0.0, 4.0}));
  // The cameras of these results stand near zero: from the page's place they are far.
  EXPECT_EQ(input.after.photos[0].camera_from_world->translation.y(), origin.y());
  summary["change"]["origin_u"] = {1, 2};
  write_json_file(results.directory / "summary.json", summary);
  EXPECT_INPUT_ERROR(read_results(results.directory.path()), "origin_u: expected 3 numbers");
}

TEST(ReadResults, WhatIsMissingOrDoesNotFitIsNamed) {
  const TemporaryDirectory empty;
  EXPECT_INPUT_ERROR(read_results(empty.path()), "no summary.json");
  {
    const Results results;
    std::filesystem::remove(results.directory / "after.ply");
    EXPECT_INPUT_ERROR(read_results(results.directory.path()), "after.ply");
  }
  {
    const Results results;
    write_colmap_text(results.directory / "colmap", std::vector<View>{});
    EXPECT_INPUT_ERROR(read_results(results.directory.path()), "expected the 2 cameras before/*");
  }
  {
    const Results results;
    write_json_file(results.directory / "summary.json", {{"change", {{"scene_extent_u", 0}}}});
    EXPECT_INPUT_ERROR(read_results(results.directory.path()),
                       "scene_extent_u: expected a positive number");
  }
  {
    const Results results;
    NpzWriter npz(results.directory / "change.npz");
    const std::vector<float> flat(48);
    npz.add<float>("score_t1", {48}, flat);
    npz.finish();
    EXPECT_INPUT_ERROR(read_results(results.directory.path()), "score_t1");
  }
}

}  // namespace
}  // namespace vggtcd
