// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/evaluation/kept_rivals.h"

#include <gtest/gtest.h>

#include "tests/support/test_files.h"

namespace vggtcd {
namespace {

Reconstruction one_pixel(float depth) {
  Reconstruction r;
  r.width = r.height = 1;
  r.views.resize(1);
  r.depth = {depth};
  r.confidence = {1};
  r.color = {1, 2, 3};
  return r;
}

class KeptRivals : public testing::Test {
 protected:
  // Counts its calls and answers with a scale that no two calls share.
  RegistrationMethod counting() {
    return {"counting", "Counting", true,
            [this](const RegistrationProblem&) {
              Sim3 answer;
              answer.scale = ++calls_;
              if (fails_) throw_error(ErrorCode::kDegenerate, "no answer today");
              return answer;
            },
            ""};
  }
  MethodAnswer ask(const RegistrationProblem& problem) {
    return run_or_recall(counting(), problem, hash_of_epochs(problem), directory_.path());
  }

  TemporaryDirectory directory_;
  int calls_ = 0;
  bool fails_ = false;
  const Reconstruction near_ = one_pixel(1), far_ = one_pixel(2);
  const JointReconstruction joint_{};
};

TEST_F(KeptRivals, AnswersAboutTheSamePointsAreGivenOnce) {
  EXPECT_EQ(ask({near_, far_, joint_}).found.t2_from_t1.scale, 1);
  EXPECT_EQ(ask({near_, far_, joint_}).found.t2_from_t1.scale, 1);
  EXPECT_EQ(calls_, 1);
}

TEST_F(KeptRivals, OtherPointsAreAnotherQuestion) {
  ask({near_, far_, joint_});
  EXPECT_EQ(ask({far_, near_, joint_}).found.t2_from_t1.scale, 2);
  Reconstruction moved = near_;
  moved.views[0].camera_from_world.translation.x() = 1e-9;
  EXPECT_EQ(ask({moved, far_, joint_}).found.t2_from_t1.scale, 3);
  Reconstruction recoloured = near_;
  recoloured.color[2] = 4;
  EXPECT_EQ(ask({recoloured, far_, joint_}).found.t2_from_t1.scale, 4);
  EXPECT_EQ(directory_.num_files(), 4u + 1u);  // and their list
}

TEST_F(KeptRivals, NoAnswerIsKeptToo) {
  fails_ = true;
  EXPECT_EQ(ask({near_, far_, joint_}).failure, "no answer today");
  fails_ = false;
  EXPECT_EQ(ask({near_, far_, joint_}).failure, "no answer today");
  EXPECT_EQ(calls_, 1);
}

TEST_F(KeptRivals, AMutilatedAnswerIsComputedAgain) {
  ask({near_, far_, joint_});
  for (const auto& file : std::filesystem::directory_iterator(directory_.path())) {
    if (file.path().extension() == ".json") write_bytes(file.path(), "{\"failure\": \"\"");
  }
  EXPECT_EQ(ask({near_, far_, joint_}).found.t2_from_t1.scale, 2);
  EXPECT_EQ(ask({near_, far_, joint_}).found.t2_from_t1.scale, 2);
}

TEST_F(KeptRivals, AFileOfSomebodyElseIsNotReplaced) {
  ask({near_, far_, joint_});
  std::filesystem::path answer;
  for (const auto& file : std::filesystem::directory_iterator(directory_.path())) {
    if (file.path().extension() == ".json") answer = file.path();
  }
  std::filesystem::remove(directory_ / ".vggt-cd-results");
  write_bytes(directory_ / ".vggt-cd-results", "");
  write_bytes(answer, "notes");
  EXPECT_ERROR(ask({near_, far_, joint_}), ErrorCode::kOutput, "stands where results go");
  EXPECT_EQ(file_bytes(answer), "notes");
  EXPECT_EQ(calls_, 1);  // said before the work
}

TEST_F(KeptRivals, WithoutADirectoryNothingIsKept) {
  const RegistrationProblem problem{near_, far_, joint_};
  run_or_recall(counting(), problem, 0, {});
  EXPECT_EQ(run_or_recall(counting(), problem, 0, {}).found.t2_from_t1.scale, 2);
}

}  // namespace
}  // namespace vggtcd
