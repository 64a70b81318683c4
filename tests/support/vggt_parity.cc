// SPDX-License-Identifier: Apache-2.0
// Parity of the network with the reference, stage by stage.
#include "tests/support/vggt_parity.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "vggtcd/vggt/trace.h"

namespace vggtcd::testing {
namespace {

// The reference's names for what the depth head shows of frame 0.
std::string reference_name(const std::string& name) {
  constexpr std::string_view kHead = "depth_head.0.";
  return name.starts_with(kHead) ? "dpt_" + name.substr(kHead.size()) : name;
}

class Comparison {
 public:
  Comparison(GoldenCase& golden, const Limits& limits) : golden_(golden), limits_(limits) {}

  void operator()(std::string name, std::vector<int64_t> shape, const std::vector<float>& values) {
    trace_tensor([&](const TensorView& view) { (*this)(view); }, std::move(name), std::move(shape),
                 values.data());
  }

  void operator()(TensorView view) {
    view.name = reference_name(view.name);
    if (!golden_.has(view.name)) return;
    const Deviation found = golden_.compare(view);
    const Limit limit = limits_(view.name);
    EXPECT_LE(found.rel_l2, limit.rel_l2) << view.name << " " << found.worst;
    EXPECT_LE(found.rel_max, limit.rel_max) << view.name << " " << found.worst;
    report += fmt::format("{:18} {:.2e} {:.2e}\n", view.name, found.rel_l2, found.rel_max);
  }

  std::string report;

 private:
  GoldenCase& golden_;
  const Limits& limits_;
};

void compare_cameras(const Reconstruction& r, Comparison& compare) {
  std::vector<float> extrinsic, intrinsic;
  for (const View& view : r.views) {
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        extrinsic.push_back(static_cast<float>(view.camera_from_world.rotation(row, column)));
        intrinsic.push_back(static_cast<float>(view.pinhole.matrix()(row, column)));
      }
      extrinsic.push_back(static_cast<float>(view.camera_from_world.translation[row]));
    }
  }
  compare("extrinsic", {r.num_frames(), 3, 4}, extrinsic);
  compare("intrinsic", {r.num_frames(), 3, 3}, intrinsic);
}

}  // namespace

Limit f32_limit(std::string_view) { return {5e-6, 2e-5}; }

Limit bf16_limit(std::string_view name) {
  const auto any_of = [&](auto... names) { return ((name == names) || ...); };
  if (name.starts_with("pose_enc") || any_of("extrinsic", "intrinsic")) return {1.2e-2, 6e-2};
  if (name == "depth") return {1.2e-2, 6e-2};
  if (any_of("depth_conf", "world_points_conf")) return {8e-3, 6e-2};
  return {2e-2, 6e-2};  // tokens, maps, world points
}

ImageBatch images_of(const GoldenCase& golden) {
  const auto shape = golden.shape("images");
  return {shape[0], shape[2], shape[3], golden.whole("images"), {}};
}

std::string expect_parity(const Vggt& model, const std::string& case_name, const Limits& limits) {
  GoldenCase golden(std::string(VGGTCD_SOURCE_DIR "/tests/golden/vggt/") + case_name);
  Comparison compare(golden, limits);
  const Prediction prediction = model.reconstruct(images_of(golden), silent_progress(),
                                                  [&](const TensorView& view) { compare(view); });
  const Reconstruction& r = prediction.reconstruction;
  const int64_t frames = r.num_frames(), height = r.height, width = r.width;
  std::vector<float> poses;
  for (const PoseEncoding& pose : prediction.pose_enc) {
    poses.insert(poses.end(), pose.begin(), pose.end());
  }
  compare("pose_enc", {frames, 9}, poses);
  compare_cameras(r, compare);
  compare("depth", {frames, height, width, 1}, r.depth);
  compare("depth_conf", {frames, height, width}, r.confidence);
  compare("world_points", {frames, height, width, 3}, prediction.world_points);
  compare("world_points_conf", {frames, height, width}, prediction.world_points_conf);
  EXPECT_THAT(golden.unread(), ::testing::IsEmpty());
  return compare.report;
}

}  // namespace vggtcd::testing
