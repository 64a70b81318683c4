// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/change/explanation.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "tests/support/toy_scene.h"
#include "vggtcd/change/free_space.h"

namespace vggtcd {
namespace {

using testing_support::box_relief;
using testing_support::flat_relief;
using testing_support::kT2FromT1;
using testing_support::reconstruct;
using testing_support::ToyScene;

// A box that appeared; T1 in the scene's own frame, T2 in another.
struct Scene {
  Reconstruction before = reconstruct(
      {.frames = 5, .width = 96, .height = 72, .camera_offset = 0, .relief = flat_relief}, Sim3{});
  Reconstruction after = reconstruct(
      {.frames = 5, .width = 96, .height = 72, .camera_offset = 0.1, .relief = box_relief},
      kT2FromT1);

  // The pixel of a photo that shows a point of the toy scene.
  PixelQuestion question(bool in_after, int frame, const Eigen::Vector3d& x_in_scene) const {
    const View& view = (in_after ? after : before).views[static_cast<size_t>(frame)];
    const Eigen::Vector3d x = in_after ? kT2FromT1 * x_in_scene : x_in_scene;
    const Eigen::Vector2d uv = view.pinhole.project(view.camera_from_world * x);
    return {in_after, frame, static_cast<int>(std::lround(uv.x())),
            static_cast<int>(std::lround(uv.y()))};
  }
  FreeSpaceChange ask(const PixelQuestion& about, const FreeSpaceOptions& options = {}) const {
    return free_space_changes(before, after, kT2FromT1, options, {}, silent_progress(), &about);
  }
};

int count(const PixelExplanation& why, Vote vote) {
  int photos = 0;
  for (const PhotoTestimony& photo : why.photos) photos += photo.said.vote == vote ? 1 : 0;
  return photos;
}

TEST(ExplainPixel, PhotosOfTheTimeBeforeLookThroughTheAddedBox) {
  const Scene scene;
  const FreeSpaceChange change = scene.ask(scene.question(true, 1, {0.5, 0, 4.5}));
  ASSERT_TRUE(change.explanation);
  const PixelExplanation& why = *change.explanation;
  EXPECT_EQ(why.photo, "after/frame_1");
  EXPECT_EQ(why.label, ChangeLabel::kAdded);
  EXPECT_GE(count(why, Vote::kLooksThrough), 3);
  EXPECT_EQ(count(why, Vote::kSees), 0);
  EXPECT_GT(why.through_share, 0.95);
  for (const PhotoTestimony& photo : why.photos) {
    if (photo.said.vote != Vote::kLooksThrough) continue;
    // The box is 0.5 high and the plane straight behind it, in units of T2.
    EXPECT_NEAR(photo.said.gap_u, 0.5 * 1.7, 0.08);
    EXPECT_NEAR(photo.said.z, 4.5 * 1.7, 0.4);
    EXPECT_LE(photo.said.near, photo.said.far);
    EXPECT_GT(photo.weight, 0);
    EXPECT_THAT(photo.photo, testing::StartsWith("before/frame_"));
  }
}

TEST(ExplainPixel, APointOfThePlaneIsSeen) {
  const Scene scene;
  const FreeSpaceChange change = scene.ask(scene.question(true, 2, {1.3, 0.3, 5}));
  ASSERT_TRUE(change.explanation);
  EXPECT_EQ(change.explanation->label, ChangeLabel::kUnchanged);
  EXPECT_GE(count(*change.explanation, Vote::kSees), 3);
  EXPECT_EQ(count(*change.explanation, Vote::kLooksThrough), 0);
  EXPECT_EQ(change.explanation->through_share, 0);
}

TEST(ExplainPixel, APointBehindTheBoxIsHidden) {
  const Scene scene;
  const FreeSpaceChange change = scene.ask(scene.question(false, 1, {0.5, 0, 5}));
  ASSERT_TRUE(change.explanation);
  const PixelExplanation& why = *change.explanation;
  EXPECT_EQ(why.photo, "before/frame_1");
  EXPECT_GE(count(why, Vote::kHidden), 3);
  EXPECT_EQ(count(why, Vote::kLooksThrough) + count(why, Vote::kSees), 0);
  for (const PhotoTestimony& photo : why.photos) EXPECT_EQ(photo.weight, 0);
  EXPECT_NE(why.label, ChangeLabel::kRemoved);
}

// With voxels for one point each and no smoothing, the fused answer is the table's own sum.
TEST(ExplainPixel, TheVotesOfTheTableAddUpToTheFusedShare) {
  const Scene scene;
  FreeSpaceOptions alone;
  alone.fusion_grid = 200000;
  alone.smooth_radius = alone.median_radius_px = 0;
  for (const Eigen::Vector3d& x : {Eigen::Vector3d(0.5, 0, 4.5), {0.2, 0.1, 4.5}, {1.3, 0.3, 5}}) {
    const PixelQuestion about = scene.question(true, 2, x);
    const FreeSpaceChange change = scene.ask(about, alone);
    ASSERT_TRUE(change.explanation);
    int weight = 0, through = 0, votes = 0;
    for (const PhotoTestimony& photo : change.explanation->photos) {
      weight += photo.weight;
      votes += photo.weight > 0 ? 1 : 0;
      through += photo.said.vote == Vote::kLooksThrough ? photo.weight : 0;
    }
    ASSERT_GT(weight, 0);
    EXPECT_EQ(change.explanation->votes, votes);
    EXPECT_NEAR(change.explanation->through_share, static_cast<double>(through) / weight, 1e-6);
    const size_t pixel = static_cast<size_t>((2 * 72 + about.y) * 96 + about.x);
    EXPECT_EQ(change.explanation->label, change.t2.label[pixel]);
    if (!is_change(change.t2.label[pixel])) continue;
    const auto changed_before = std::count_if(change.t2.label.begin(),
                                              change.t2.label.begin() + static_cast<int64_t>(pixel),
                                              [](ChangeLabel label) { return is_change(label); });
    EXPECT_EQ(change.explanation->confidence,
              change.t2.changed_confidence[static_cast<size_t>(changed_before)]);
  }
}

TEST(ExplainPixel, AskingChangesNoAnswer) {
  const Scene scene;
  const FreeSpaceChange asked = scene.ask(scene.question(true, 1, {0.5, 0, 4.5}));
  const FreeSpaceChange plain = free_space_changes(scene.before, scene.after, kT2FromT1, {});
  EXPECT_FALSE(plain.explanation);
  EXPECT_EQ(asked.t1.label, plain.t1.label);
  EXPECT_EQ(asked.t2.label, plain.t2.label);
}

TEST(ExplainPixel, TheSentenceAndTheTableNameTheAnswerAndEveryPhoto) {
  const Scene scene;
  const FreeSpaceChange change = scene.ask(scene.question(true, 1, {0.5, 0, 4.5}));
  ASSERT_TRUE(change.explanation);
  const std::string sentence = explanation_sentence(*change.explanation);
  EXPECT_THAT(sentence, testing::HasSubstr("of after/frame_1: added with confidence"));
  EXPECT_THAT(sentence, testing::Not(testing::HasSubstr("\n")));
  const std::string table = explanation_table(*change.explanation);
  EXPECT_THAT(table, testing::HasSubstr("looks_through"));
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'),
            1 + static_cast<int64_t>(change.explanation->photos.size()));
}

TEST(ParsePixelQuestion, TakesAPhotoByNameOrNumber) {
  const Scene scene;
  const auto parse = [&](const char* text) {
    return parse_pixel_question(text, scene.before, scene.after);
  };
  const PixelQuestion named = parse("95,71,after/frame_3"), numbered = parse("0,7,before/2");
  EXPECT_TRUE(named.in_after);
  EXPECT_EQ(named.frame, 3);
  EXPECT_EQ(named.x, 95);
  EXPECT_EQ(named.y, 71);
  EXPECT_FALSE(numbered.in_after);
  EXPECT_EQ(numbered.frame, 2);
  EXPECT_EQ(numbered.y, 7);
}

TEST(ParsePixelQuestion, RefusesInOneLineWhatItCannotAnswer) {
  const Scene scene;
  for (const auto& [text, names] : {std::pair{"96,0,after/1", "96 x 72"},
                                    {"0,-1,after/1", "outside"},
                                    {"1,1,after/frame_9", "no photo \"frame_9\""},
                                    {"1,1,before/5", "from 0 to 4"},
                                    {"1,1,during/1", "before/PHOTO"},
                                    {"1,1", "before/PHOTO"},
                                    {"", "before/PHOTO"},
                                    {"a,1,after/1", "before/PHOTO"},
                                    {"1,1,after", "before/PHOTO"}}) {
    try {
      parse_pixel_question(text, scene.before, scene.after);
      ADD_FAILURE() << text;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kUsage);
      EXPECT_THAT(error.what(), testing::HasSubstr(names)) << text;
      EXPECT_THAT(error.what(), testing::Not(testing::HasSubstr("\n")));
    }
  }
}

TEST(CheckPixelQuestion, RefusesWhatNamesNoPixelBeforeAnyPhotoIsRead) {
  EXPECT_NO_THROW(check_pixel_question("7,8,after/IMG,1.jpg"));
  for (const char* text : {"", "7,8", "7,8,IMG.jpg", "7.5,8,after/1", "7,,after/1"}) {
    EXPECT_THROW(check_pixel_question(text), Error) << text;
  }
}

}  // namespace
}  // namespace vggtcd
