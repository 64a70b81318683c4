// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/vggt/batch_file.h"

#include <gmock/gmock.h>

#include <limits>

#include "tests/support/test_files.h"
#include "vggtcd/core/error.h"
#include "vggtcd/io/npz.h"
#include "vggtcd/io/predictions.h"

namespace vggtcd {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

class BatchFile : public ::testing::Test {
 protected:
  void write(const std::vector<int64_t>& shape, const std::vector<float>& values) const {
    NpzWriter npz(path_);
    npz.add<float>("images", shape, values);
    npz.finish();
  }
  std::string error() const {
    try {
      read_image_batch(path_);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kInput);
      EXPECT_THAT(error.what(), HasSubstr(path_.string()));
      return error.what();
    }
    return "";
  }
  const TemporaryDirectory temporary_;
  const fs::path path_ = temporary_ / "batch.npz";
};

TEST_F(BatchFile, ImagesAreReadAsTheyAre) {
  std::vector<float> values;
  for (int i = 0; i < 2 * 3 * 2 * 4; ++i) values.push_back(static_cast<float>(i) / 100);
  write({2, 3, 2, 4}, values);
  const ImageBatch batch = read_image_batch(path_);
  EXPECT_EQ(batch.frames, 2);
  EXPECT_EQ(batch.height, 2);
  EXPECT_EQ(batch.width, 4);
  EXPECT_EQ(batch.pixels, values);
}

TEST_F(BatchFile, OtherShapesAndValuesAreRefused) {
  write({1, 2, 2, 3}, std::vector<float>(12));
  EXPECT_NE(error(), "");
  write({3, 2, 2}, std::vector<float>(12));
  EXPECT_NE(error(), "");
  for (const float bad : {255.0f, -0.5f, std::numeric_limits<float>::quiet_NaN()}) {
    std::vector<float> values(12, 0.5f);
    values[7] = bad;
    write({1, 3, 2, 2}, values);
    EXPECT_THAT(error(), HasSubstr("[0, 1]"));
  }
  NpzWriter npz(path_);
  const std::vector<float> values(1);
  npz.add<float>("depth", {1}, values);
  npz.finish();
  EXPECT_THAT(error(), HasSubstr("no such key"));
}

// What is written is a prediction file as any other: its reader gives the cameras back.
TEST_F(BatchFile, PredictionsAreReadAgainByTheReaderOfPredictions) {
  Prediction prediction;
  Reconstruction& r = prediction.reconstruction;
  r.height = 2;
  r.width = 3;
  for (int frame = 0; frame < 2; ++frame) {
    View view;
    view.camera_from_world.translation = {0.5 * frame, 0.25, -1};
    view.pinhole = {2, 3, 1.5, 1, 3, 2};
    view.name = frame == 0 ? "first.jpg" : "second.jpg";
    r.views.push_back(view);
    prediction.pose_enc.push_back({0, 0, 0, 0, 0, 0, 1, 1, 1});
  }
  for (int i = 0; i < 12; ++i) {
    r.depth.push_back(static_cast<float>(1 + i));
    r.confidence.push_back(static_cast<float>(2 + i));
  }
  r.color.assign(36, 51);
  ImageBatch images{2, 2, 3, std::vector<float>(36, 51.0f / 255.0f), {}};
  write_prediction(path_, images, prediction);

  const Reconstruction found = read_reconstruction(path_, silent_progress());
  EXPECT_EQ(found.depth, r.depth);
  EXPECT_EQ(found.confidence, r.confidence);
  EXPECT_EQ(found.color, r.color);
  ASSERT_EQ(found.num_frames(), 2);
  EXPECT_EQ(found.views[1].name, "second.jpg");
  EXPECT_EQ(found.views[1].camera_from_world.translation, Eigen::Vector3d(0.5, 0.25, -1));
  EXPECT_EQ(found.views[1].pinhole.fy, 3);
  const NpzReader npz(path_);
  EXPECT_EQ(npz.header("depth").shape, (std::vector<int64_t>{2, 2, 3, 1}));
  EXPECT_EQ(npz.header("images").shape, (std::vector<int64_t>{2, 3, 2, 3}));
  EXPECT_EQ(npz.header("pose_enc").shape, (std::vector<int64_t>{2, 9}));
  EXPECT_FALSE(npz.has("world_points"));
}

}  // namespace
}  // namespace vggtcd
