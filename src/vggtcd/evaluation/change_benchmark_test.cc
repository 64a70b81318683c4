// SPDX-License-Identifier: Apache-2.0
// The four ways of counting, by hand on a row of pixels.
#include "vggtcd/evaluation/change_benchmark.h"

#include <gtest/gtest.h>

#include <limits>

namespace vggtcd {
namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

// Eight pixels: label, whether the other epoch looked, score, called.
class ScoreChanges : public testing::Test {
 protected:
  ScoreChanges() {
    add(kLabelChanged, true, 0.9f, true);
    add(kLabelChanged, true, 0.2f, false);
    add(kLabelChanged, true, kNone, true);  // without evidence a call is no call
    add(kLabelChanged, false, 0.8f, true);
    add(kLabelUnchanged, true, 0.7f, true);
    add(kLabelUnchanged, false, 0.6f, true);
    add(kLabelUnchanged, false, kNone, false);
    add(kLabelVoid, true, 1.0f, true);
  }
  void add(uint8_t label, bool looked, float score, bool called, uint16_t object = 1) {
    truth_.label.push_back(label);
    truth_.object.push_back(object);
    truth_.other_looked.push_back(looked ? 1 : 0);
    answer_.score.push_back(score);
    answer_.called.push_back(called ? 1 : 0);
  }
  ChangeOutcome score(bool unseen_counted, bool every_pixel) const {
    return score_changes({{truth_, answer_}}, unseen_counted, every_pixel);
  }
  EpochTruth truth_;
  ChangeAnswer answer_;
};

TEST_F(ScoreChanges, OnlySurfaceThatBothSawWithEvidence) {
  const ChangeOutcome outcome = score(false, false);
  EXPECT_EQ(outcome.scores.pixels, 3);
  EXPECT_EQ(outcome.scores.changed_pixels, 2);
  EXPECT_DOUBLE_EQ(outcome.scores.precision, 1.0 / 2);
  EXPECT_DOUBLE_EQ(outcome.scores.recall, 1.0 / 2);
  EXPECT_DOUBLE_EQ(outcome.scores.false_alarms, 1);
  EXPECT_DOUBLE_EQ(outcome.unseen_called_changed, 1);  // the other one has no evidence
}

TEST_F(ScoreChanges, TheSkyIsUnchangedWhereAnythingIsSaid) {
  const ChangeOutcome without = score(false, true);
  add(kLabelVoid, false, kNone, false, 0);  // nothing said: right, and not counted
  EXPECT_EQ(score(false, true).scores.pixels, without.scores.pixels);
  add(kLabelVoid, false, 0.95f, true, 0);
  add(kLabelVoid, false, 0.1f, false, 0);
  for (const bool every_pixel : {false, true}) {
    const ChangeOutcome outcome = score(false, every_pixel);
    EXPECT_EQ(outcome.scores.pixels, every_pixel ? 6 : 5);
    EXPECT_DOUBLE_EQ(outcome.scores.precision, 1.0 / 3);
    EXPECT_DOUBLE_EQ(outcome.scores.false_alarms, 2.0 / 3);
    EXPECT_DOUBLE_EQ(outcome.sky_called_changed, 1.0 / 3);
    EXPECT_DOUBLE_EQ(outcome.evidence, without.evidence);  // of surface
  }
}

TEST_F(ScoreChanges, NeverSeenSurfaceIsCountedAsWhatItIs) {
  const ChangeOutcome outcome = score(true, false);
  EXPECT_EQ(outcome.scores.pixels, 5);
  EXPECT_DOUBLE_EQ(outcome.scores.precision, 2.0 / 4);
  EXPECT_DOUBLE_EQ(outcome.scores.recall, 2.0 / 3);
}

TEST_F(ScoreChanges, WithoutEvidenceIsCalledUnchangedWhereEveryPixelCounts) {
  const ChangeOutcome outcome = score(false, true);
  EXPECT_EQ(outcome.scores.pixels, 4);
  EXPECT_DOUBLE_EQ(outcome.scores.recall, 1.0 / 3);
  EXPECT_DOUBLE_EQ(outcome.unseen_called_changed, 1.0 / 2);
  EXPECT_EQ(score(true, true).scores.pixels, 7);
}

TEST_F(ScoreChanges, EvidenceIsAShareOfTheLabelledPixelsHoweverTheyCount) {
  for (const bool unseen : {false, true}) {
    for (const bool every : {false, true}) {
      EXPECT_DOUBLE_EQ(score(unseen, every).evidence, 5.0 / 7);
    }
  }
}

}  // namespace
}  // namespace vggtcd
