// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/evaluation/pose_pairs.h"

#include <gmock/gmock.h>

#include "tests/support/test_files.h"

namespace vggtcd {
namespace {

using testing::ElementsAre;

// A pose is told apart by its translation: the number of the photo that it is.
TrajectoryFile file_of(PoseNames names, const std::vector<std::pair<std::string, int>>& poses) {
  TrajectoryFile file;
  file.names = names;
  for (const auto& [name, photo] : poses) {
    Rigid3 pose;
    pose.translation.x() = photo;
    file.poses.push_back({name, pose});
  }
  return file;
}

std::vector<std::pair<int, int>> photos_of(const PosePairs& pairs) {
  std::vector<std::pair<int, int>> photos;
  for (size_t i = 0; i < std::max(pairs.predicted.size(), pairs.truth.size()); ++i) {
    const auto photo = [&](const std::vector<Rigid3>& poses) {
      return i < poses.size() ? static_cast<int>(poses[i].translation.x()) : -1;
    };
    photos.emplace_back(photo(pairs.predicted), photo(pairs.truth));
  }
  return photos;
}

std::vector<std::pair<int, int>> paired(const TrajectoryFile& predicted,
                                        const TrajectoryFile& truth) {
  return photos_of(pair_poses(predicted, "p.tum", truth, "t.tum"));
}

constexpr PoseNames kNumbers = PoseNames::kNumbers, kTime = PoseNames::kTimeStamps,
                    kPhotos = PoseNames::kPhotos;

TEST(PairPoses, TimeStampsDecideNotTheOrderOfLines) {
  const auto truth = file_of(kTime, {{"10.0", 0}, {"10.033", 1}, {"10.066", 2}, {"10.1", 3}});
  const auto joined = file_of(kTime, {{"10.066", 2}, {"10.1", 3}, {"10.0", 0}, {"10.0331", 1}});
  EXPECT_THAT(paired(joined, truth),
              ElementsAre(std::pair(0, 0), std::pair(1, 1), std::pair(2, 2), std::pair(3, 3)));
}

TEST(PairPoses, WhatOneFileLostIsLeftOut) {
  const auto lost_first = file_of(kTime, {{"1.5", 1}, {"2.5", 2}, {"3.5", 3}});
  const auto lost_last = file_of(kTime, {{"0.5", 0}, {"1.5", 1}, {"2.5", 2}});
  const PosePairs pairs = pair_poses(lost_first, "p", lost_last, "t");
  EXPECT_THAT(photos_of(pairs), ElementsAre(std::pair(1, 1), std::pair(2, 2)));
  EXPECT_EQ(pairs.predicted_alone, 1u);
  EXPECT_EQ(pairs.truth_alone, 1u);
}

TEST(PairPoses, ADenserTruthGivesTheNearestPoseToEach) {
  const auto truth = file_of(kTime, {{"0.100", 0}, {"0.105", 1}, {"0.110", 2}, {"0.115", 3}});
  EXPECT_THAT(paired(file_of(kTime, {{"0.1062", 1}}), truth), ElementsAre(std::pair(1, 1)));
  // Two poses never share one: the nearer has it.
  EXPECT_THAT(paired(file_of(kTime, {{"0.118", 5}, {"0.1155", 3}}), truth),
              ElementsAre(std::pair(3, 3)));
}

TEST(PairPoses, TimeStampsWithNothingInCommonOrTwiceAreRefused) {
  const auto truth = file_of(kTime, {{"10.5", 0}, {"11.5", 1}});
  EXPECT_INPUT_ERROR(paired(file_of(kTime, {{"20.5", 0}, {"21.5", 1}}), truth),
                     "p.tum: expected the time stamps of t.tum");
  EXPECT_INPUT_ERROR(paired(truth, file_of(kTime, {{"10.5", 0}, {"11", 1}, {"10.50", 2}})),
                     "t.tum: expected every time stamp once, found 10.5");
}

TEST(PairPoses, NumbersFollowTheOrderOfTimeButNotOfShuffledLines) {
  const auto numbers = file_of(kNumbers, {{"0", 0}, {"1", 1}, {"2", 2}});
  const auto rising = file_of(kTime, {{"130.1", 0}, {"130.2", 1}, {"130.3", 2}});
  EXPECT_THAT(paired(numbers, rising),
              ElementsAre(std::pair(0, 0), std::pair(1, 1), std::pair(2, 2)));
  const auto shuffled = file_of(kTime, {{"130.3", 2}, {"130.1", 0}, {"130.2", 1}});
  EXPECT_INPUT_ERROR(paired(numbers, shuffled), "t.tum: expected rising time stamps");
  EXPECT_INPUT_ERROR(paired(numbers, shuffled), "found 130.1 after 130.3; sort the lines");
  // Unequal numbers are for the caller to see.
  EXPECT_THAT(paired(numbers, file_of(kTime, {{"130.1", 0}, {"130.2", 1}})),
              ElementsAre(std::pair(0, 0), std::pair(1, 1), std::pair(2, -1)));
}

TEST(PairPoses, NumbersThatLackSomeAreStillThoseNumbers) {
  const auto numbers = file_of(kNumbers, {{"0", 0}, {"1", 1}, {"2", 2}, {"3", 3}});
  EXPECT_THAT(paired(numbers, file_of(kTime, {{"0", 0}, {"2", 2}, {"3", 3}})),
              ElementsAre(std::pair(0, 0), std::pair(2, 2), std::pair(3, 3)));
  EXPECT_THAT(paired(file_of(kTime, {{"1", 1}, {"0", 0}, {"3", 3}, {"2", 2}}), numbers),
              ElementsAre(std::pair(0, 0), std::pair(1, 1), std::pair(2, 2), std::pair(3, 3)));
}

TEST(PairPoses, PhotosArePairedByNameWhateverTheFolder) {
  const auto truth =
      file_of(kPhotos, {{"before/a.jpg", 0}, {"before/b.jpg", 1}, {"before/c.jpg", 2}});
  EXPECT_THAT(paired(file_of(kPhotos, {{"b.jpg", 1}, {"c.jpg", 2}, {"d.jpg", 3}}), truth),
              ElementsAre(std::pair(1, 1), std::pair(2, 2)));
  const auto two_cameras = file_of(kPhotos, {{"left/1.jpg", 0}, {"right/1.jpg", 1}});
  EXPECT_THAT(paired(file_of(kPhotos, {{"right/1.jpg", 1}, {"left/1.jpg", 0}}), two_cameras),
              ElementsAre(std::pair(0, 0), std::pair(1, 1)));
  // Names of other photos altogether say nothing.
  EXPECT_THAT(paired(file_of(kPhotos, {{"x.jpg", 0}, {"y.jpg", 1}}), two_cameras),
              ElementsAre(std::pair(0, 0), std::pair(1, 1)));
}

}  // namespace
}  // namespace vggtcd
