// SPDX-License-Identifier: Apache-2.0
// The rule of instance_metrics.h, counted by hand on rows of pixels.
#include "vggtcd/evaluation/instance_metrics.h"

#include <gtest/gtest.h>

#include <string>

#include "vggtcd/evaluation/synthetic/render.h"

namespace vggtcd {
namespace {

// One character per pixel. truth: '.' unchanged surface, a letter: changed object (A = 1, ...), the
// small letter: the same, but never seen by the other epoch, '#' void, '~' sky. reported: '.' none,
// digits.
struct Row {
  std::vector<int32_t> reported;
  std::vector<uint16_t> object;
  std::vector<uint8_t> label, other_looked;

  Row(const std::string& truth, const std::string& answer) {
    EXPECT_EQ(truth.size(), answer.size());
    for (const char c : truth) {
      const bool upper = c >= 'A' && c <= 'Z', lower = c >= 'a' && c <= 'z';
      const bool none = c == '#' || c == '~';
      object.push_back(static_cast<uint16_t>(upper      ? c - 'A' + 1
                                             : lower    ? c - 'a' + 1
                                             : c == '~' ? 0
                                                        : 26));
      label.push_back(upper || lower ? kLabelChanged : none ? kLabelVoid : kLabelUnchanged);
      other_looked.push_back(lower ? 0 : 1);
    }
    for (const char c : answer) reported.push_back(c == '.' ? 0 : c - '0');
  }
  InstancePixels pixels() const { return {reported, object, label, other_looked}; }
};

InstanceScores evaluate(const std::string& truth, const std::string& answer) {
  const Row row(truth, answer);
  const InstancePixels epochs[] = {row.pixels()};
  std::vector<double> size(27, 0.1);
  size[26] = 0.01;  // 'Z' is too small to count
  return evaluate_instances(epochs, size);
}

TEST(EvaluateInstances, AQuarterCoveredByARightInstanceIsFound) {
  const InstanceScores quarter = evaluate("AAAAAAAA....", "11..........");
  EXPECT_EQ(quarter.objects, 1);
  EXPECT_EQ(quarter.found, 1);
  EXPECT_EQ(quarter.told_apart, 1);
  EXPECT_EQ(quarter.right, 1);
  EXPECT_EQ(evaluate("AAAAAAAA....", "1...........").found, 0);  // an eighth
  // Two halves of a quarter are not one instance with a quarter.
  EXPECT_EQ(evaluate("AAAAAAAA....", "12..........").found, 0);
}

TEST(EvaluateInstances, AnInstanceMostlyOnUnchangedSurfaceFindsNothing) {
  const InstanceScores half = evaluate("AAAA....", "..1111..");
  EXPECT_EQ(half.found, 1);
  EXPECT_EQ(half.right, 1);
  const InstanceScores less = evaluate("AAAA....", "..11111.");
  EXPECT_EQ(less.found, 0);
  EXPECT_EQ(less.right, 0);
  EXPECT_EQ(less.reported, 1);
  EXPECT_DOUBLE_EQ(less.precision(), 0);
}

TEST(EvaluateInstances, AThingInTheSkyIsWrong) {
  const InstanceScores alone = evaluate("AAAA~~~~", "1111222.");
  EXPECT_EQ(alone.reported, 2);
  EXPECT_EQ(alone.right, 1);
  EXPECT_EQ(evaluate("AAAA~~~~~", "111111111").right, 0);   // more sky than object
  EXPECT_EQ(evaluate("AAAA####", "11112222").reported, 1);  // what is only void is not counted
}

TEST(EvaluateInstances, OneInstanceOverTwoObjectsFindsBothAndTellsTheLargerApart) {
  const InstanceScores scores = evaluate("AAAABB..", "111111..");
  EXPECT_EQ(scores.objects, 2);
  EXPECT_EQ(scores.found, 2);
  EXPECT_EQ(scores.told_apart, 1);
  EXPECT_EQ(scores.reported, 1);
  EXPECT_DOUBLE_EQ(scores.recall(), 1);
}

TEST(EvaluateInstances, SmallAndNeverSeenObjectsAreNotExpectedAndCostNoPrecision) {
  const InstanceScores scores = evaluate("ZZaaBB..", "112233..");
  EXPECT_EQ(scores.objects, 1);  // B
  EXPECT_EQ(scores.small, 1);
  EXPECT_EQ(scores.reported, 3);
  EXPECT_EQ(scores.right, 3);
}

TEST(EvaluateInstances, VoidPixelsCountForNothing) {
  const InstanceScores scores = evaluate("AA####..", "1111.222");
  EXPECT_EQ(scores.found, 1);
  EXPECT_EQ(scores.reported, 2);
  EXPECT_EQ(scores.right, 1);
}

TEST(EvaluateInstances, AnObjectInAFewPixelsOfManyIsNotExpected) {
  std::string truth(20000, '.'), answer(20000, '.');
  truth[0] = truth[1] = truth[2] = 'A';  // 1.5e-4
  EXPECT_EQ(evaluate(truth, answer).hardly_seen, 1);
  truth[3] = 'A';  // 2e-4
  EXPECT_EQ(evaluate(truth, answer).objects, 1);
}

TEST(EvaluateInstances, EveryPlaceOfAMovedObjectCounts) {
  const Row t1("AA..", "11.."), t2("..AA", "....");
  const InstancePixels epochs[] = {t1.pixels(), t2.pixels()};
  const InstanceScores scores = evaluate_instances(epochs, std::vector<double>(27, 0.1));
  EXPECT_EQ(scores.objects, 2);
  EXPECT_EQ(scores.found, 1);
  InstanceScores sum = scores;
  sum += scores;
  EXPECT_EQ(sum.objects, 4);
  EXPECT_DOUBLE_EQ(sum.recall(), 0.5);
}

}  // namespace
}  // namespace vggtcd
