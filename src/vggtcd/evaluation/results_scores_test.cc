// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/evaluation/results_scores.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/support/test_files.h"
#include "vggtcd/io/colmap.h"
#include "vggtcd/io/npz.h"

namespace vggtcd {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

View view_at(const std::string& name, double x, double y, double z) {
  View view;
  view.name = name;
  view.camera_from_world.translation = {x, y, z};
  view.pinhole = {4, 4, 1.5, 0.5, 4, 2};
  return view;
}

// Three photos of 2 x 1 px before, two after. Truth: the left pixel of every photo changed.
class Results : public ::testing::Test {
 protected:
  Results() {
    std::filesystem::create_directories(results_ / "colmap");
    std::vector<double> poses;
    for (const auto& [x, y, z] : centers_) {
      poses.insert(poses.end(), {1, 0, 0, x, 0, 1, 0, y, 0, 0, 1, z});
    }
    const std::span all(poses);
    const std::vector<uint8_t> label_t1 = {1, 0, 1, 0, 1, 255}, unseen_t1 = {0, 0, 0, 1, 0, 0};
    const std::vector<uint8_t> label_t2 = {1, 0, 1, 0}, unseen_t2 = {0, 0, 0, 0};
    NpzWriter truth(truth_);
    truth.add<double>("extrinsic_t1", {3, 3, 4}, all.first(36));
    truth.add<double>("extrinsic_t2", {2, 3, 4}, all.subspan(36));
    truth.add<uint8_t>("changed_t1", {3, 1, 2}, label_t1);
    truth.add<uint8_t>("changed_t2", {2, 1, 2}, label_t2);
    const std::vector<int32_t> object(6, 1);
    truth.add<int32_t>("instance_t1", {3, 1, 2}, object);
    truth.add<int32_t>("instance_t2", {2, 1, 2}, std::span(object).first(4));
    truth.add_mask("unseen_by_other_t1", {3, 1, 2}, unseen_t1);
    truth.add_mask("unseen_by_other_t2", {2, 1, 2}, unseen_t2);
    truth.finish();
  }

  // The photos of before that were placed, by their centres, in this order; and both of after.
  void write_cameras(std::vector<std::pair<std::string, size_t>> photos) const {
    photos.insert(photos.end(), {{"after/0000.jpg", 3}, {"after/0001.jpg", 4}});
    std::vector<View> views;
    for (const auto& [name, k] : photos) {
      views.push_back(view_at(name, centers_[k].x, centers_[k].y, centers_[k].z));
    }
    write_colmap_text(results_ / "colmap", views);
  }

  // Photo 1 of before was not placed. Frames are 4 x 2 px: the middles of the truth's two pixels
  // are the corners of 2 x 2 of theirs, and the last is taken.
  void write_results(bool with_labels) const {
    write_cameras({{"before/0000.jpg", 0}, {"before/0002.jpg", 2}});
    const auto frame = [](float left, float right) {
      constexpr float kElsewhere = 99;  // never to be looked at
      return std::vector<float>{kElsewhere, kElsewhere, kElsewhere, kElsewhere,
                                kElsewhere, left,       kElsewhere, right};
    };
    std::vector<float> t1 = frame(9, 1), t2 = frame(3, 8);
    const std::vector<float> second = frame(7, kNan), fourth = frame(kNan, 2);
    t1.insert(t1.end(), second.begin(), second.end());
    t2.insert(t2.end(), fourth.begin(), fourth.end());
    const auto called = [](const std::vector<float>& scores) {
      std::vector<uint8_t> changed;
      for (const float score : scores) changed.push_back(score > 5 ? 1 : 0);
      return changed;
    };
    const std::vector<uint8_t> changed_t1 = called(t1), changed_t2 = called(t2);
    std::vector<uint8_t> label_t1(16, 0), label_t2(16, 0);
    label_t2[5] = 3;     // the left pixel of the first photo
    label_t1[15] = 255;  // the right one of the second
    // Votes judge the pixel that has no distance, and rank by gaps, which may be negative.
    std::vector<float> evidence_t1 = frame(6, -2), evidence_t2 = frame(kNan, -1);
    const std::vector<float> evidence_second = frame(-3, kNan), evidence_fourth = frame(5, -4);
    evidence_t1.insert(evidence_t1.end(), evidence_second.begin(), evidence_second.end());
    evidence_t2.insert(evidence_t2.end(), evidence_fourth.begin(), evidence_fourth.end());
    NpzWriter change(results_ / "change.npz");
    change.add<float>("score_t1", {2, 2, 4}, t1);
    change.add<float>("score_t2", {2, 2, 4}, t2);
    change.add_mask("changed_t1", {2, 2, 4}, changed_t1);
    change.add_mask("changed_t2", {2, 2, 4}, changed_t2);
    if (with_labels) {
      change.add<uint8_t>("label_t1", {2, 2, 4}, label_t1);
      change.add<uint8_t>("label_t2", {2, 2, 4}, label_t2);
      change.add<float>("evidence_t1", {2, 2, 4}, evidence_t1);
      change.add<float>("evidence_t2", {2, 2, 4}, evidence_t2);
    }
    change.finish();
  }

  struct Center {
    double x, y, z;
  };
  const std::vector<Center> centers_ = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 1}, {2, 0, 1}};
  const TemporaryDirectory temporary_;
  const std::filesystem::path results_ = temporary_ / "results", truth_ = temporary_ / "truth.npz";
};

TEST_F(Results, AreCountedPixelByPixelOfTheTruth) {
  write_results(false);
  const ResultsScores scores = score_results(results_, truth_);
  EXPECT_EQ(scores.frames_t1, 2);
  EXPECT_EQ(scores.true_frames_t1, 3);
  EXPECT_NEAR(scores.cameras.ate_mean, 0, 1e-12);
  // Surface both saw: photo 0 (changed 9, unchanged 1), photo 1 (changed, not placed), photo 2
  // (changed 7; the other pixel is void); after: (changed 3, unchanged 8), (changed NaN, unchanged
  // 2).
  EXPECT_EQ(scores.every_pixel.pixels, 8);
  EXPECT_EQ(scores.evidence.pixels, 6);
  EXPECT_DOUBLE_EQ(scores.evidence_share, 6.0 / 8);
  EXPECT_DOUBLE_EQ(scores.evidence.precision, 2.0 / 3);
  EXPECT_DOUBLE_EQ(scores.evidence.recall, 2.0 / 3);
  EXPECT_DOUBLE_EQ(scores.every_pixel.recall, 2.0 / 5);
  EXPECT_EQ(scores.most_changed_t1, "before/0000.jpg");
  // The never-seen pixel lies in the photo that was not placed.
  EXPECT_DOUBLE_EQ(scores.unseen_called_changed, 0);
}

TEST_F(Results, OfVotesHaveEvidenceWhereThereIsALabelAndRankByTheGapInSigmas) {
  write_results(true);
  const ResultsScores scores = score_results(results_, truth_);
  // Photo 0 (changed 6, unchanged -2), photo 2 (changed -3), after: (changed, not observed;
  // unchanged -1), (changed 5, unchanged -4).
  EXPECT_EQ(scores.every_pixel.pixels, 8);
  EXPECT_EQ(scores.evidence.pixels, 7);
  // Changed are the ranks 1, 2, 5 and 7 of 7.
  EXPECT_DOUBLE_EQ(scores.evidence.auprc, (1.0 + 1.0 + 3.0 / 5 + 4.0 / 7) / 4);
}

TEST_F(Results, BelongToPhotosInTheOrderOfTheFramesNotOfTheNames) {
  write_results(false);
  write_cameras({{"before/0002.jpg", 2}, {"before/0000.jpg", 0}});
  const ResultsScores scores = score_results(results_, truth_);
  EXPECT_NEAR(scores.cameras.ate_mean, 0, 1e-12);
  // Now photo 0 has (changed 7, unchanged NaN) and photo 2 (changed 9; the other pixel is void).
  EXPECT_EQ(scores.every_pixel.pixels, 8);
  EXPECT_EQ(scores.evidence.pixels, 5);
  EXPECT_EQ(scores.most_changed_t1, "before/0002.jpg");
}

TEST_F(Results, OfOtherPhotosAreRefused) {
  write_results(false);
  std::vector<View> views = {view_at("before/a.jpg", 0, 0, 0), view_at("before/b.jpg", 1, 0, 0),
                             view_at("after/a.jpg", 0, 1, 0), view_at("after/b.jpg", 0, 0, 1)};
  write_colmap_text(results_ / "colmap", views);
  EXPECT_INPUT_ERROR(score_results(results_, truth_), "not those of the 3 photos");
}

// The same number of values in another shape: another pixel would be looked up.
TEST_F(Results, ArraysOfUnequalShapesAreRefused) {
  write_results(false);
  const std::vector<float> scores(16, 1);
  const std::vector<uint8_t> changed(16, 1);
  NpzWriter change(results_ / "change.npz");
  for (const std::string epoch : {"_t1", "_t2"}) {
    change.add<float>("score" + epoch, {2, 2, 4}, scores);
    change.add_mask("changed" + epoch, {2, 4, 2}, changed);
  }
  change.finish();
  EXPECT_INPUT_ERROR(score_results(results_, truth_), "changed_t1: expected shape [2, 2, 4]");
}

}  // namespace
}  // namespace vggtcd
