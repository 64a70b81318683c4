// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/scene/keyframes.h"

#include <gmock/gmock.h>

#include <cstdlib>
#include <set>

#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

using testing::ElementsAre;

TEST(SelectKeyframes, FollowsTheWorkedExample) {
  // 0, then 83 (83 away), then 41 (41 from 83, 41 from 0; 42 ties with it), 62 (21 from 41 and
  // 83), 20.
  EXPECT_THAT(select_keyframes(84, 5), ElementsAre(0, 20, 41, 62, 83));
  EXPECT_THAT(select_keyframes(10, 2), ElementsAre(0, 9));
  EXPECT_THAT(select_keyframes(10, 3), ElementsAre(0, 4, 9));
}

TEST(SelectKeyframes, TakesAllFramesWhenThereAreTooFew) {
  EXPECT_THAT(select_keyframes(3, 5), ElementsAre(0, 1, 2));
  EXPECT_THAT(select_keyframes(1, 5), ElementsAre(0));
}

TEST(SelectKeyframes, AgreesWithTheEquationEvaluatedDirectly) {
  for (const int frames : {1, 2, 7, 20, 61, 100}) {
    for (const int count : {1, 2, 3, 5, 9, 50}) {
      std::set<int> chosen = {0};
      while (static_cast<int>(chosen.size()) < std::min(frames, count)) {
        int best = -1, best_distance = -1;
        for (int i = 0; i < frames; ++i) {
          int nearest = frames;
          for (const int k : chosen) nearest = std::min(nearest, std::abs(i - k));
          if (!chosen.contains(i) && nearest > best_distance) {
            best = i;
            best_distance = nearest;
          }
        }
        chosen.insert(best);
      }
      EXPECT_EQ(select_keyframes(frames, count), std::vector<int>(chosen.begin(), chosen.end()))
          << frames << " frames, " << count << " keyframes";
    }
  }
}

TEST(SelectKeyframes, RefusesNothingToChooseFrom) {
  EXPECT_THROW(select_keyframes(0, 5), Error);
  EXPECT_THROW(select_keyframes(5, 0), Error);
}

}  // namespace
}  // namespace vggtcd
