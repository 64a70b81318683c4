// SPDX-License-Identifier: Apache-2.0
// Fuzz target: a sound prediction file whose numbers the input replaces: a reconstruction that is
// what scene/reconstruction.h promises, or one line. Also as a joint pass over itself.
#include <bit>
#include <cmath>
#include <vector>

#include "tests/fuzz/fuzz_files.h"
#include "vggtcd/core/progress.h"
#include "vggtcd/io/npz.h"
#include "vggtcd/io/predictions.h"

namespace {

using vggtcd::fuzz::require;

// Cameras in a row that look at a wall 3 units away.
struct Arrays {
  int64_t frames, height, width, pose_rows;
  std::vector<double> poses, intrinsics, depth, confidence, points, keyframes;

  Arrays(int64_t s, int64_t h, int64_t w, int64_t rows)
      : frames(s), height(h), width(w), pose_rows(rows) {
    for (int64_t i = 0; i < s; ++i) {
      const double x = -0.1 * static_cast<double>(i);
      const double pose[] = {1, 0, 0, x, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
      poses.insert(poses.end(), pose, pose + 4 * rows);
      const auto side = static_cast<double>(w);
      const double intrinsic[] = {side, 0, side / 2, 0, side, static_cast<double>(h) / 2, 0, 0, 1};
      intrinsics.insert(intrinsics.end(), intrinsic, intrinsic + 9);
      keyframes.push_back(static_cast<double>(i));
    }
    depth.assign(static_cast<size_t>(s * h * w), 3.0);
    confidence.assign(depth.size(), 2.0);
    points.assign(3 * depth.size(), 3.0);
  }

  std::vector<double>* array(unsigned number) {
    std::vector<double>* const arrays[] = {&poses,      &intrinsics, &depth,
                                           &confidence, &points,     &keyframes};
    return arrays[number % std::size(arrays)];
  }
};

double number(vggtcd::fuzz::FuzzInput& input) {
  uint64_t bits = 0;
  for (int i = 0; i < 8; ++i) bits = bits << 8 | input.byte();
  return std::bit_cast<double>(bits);
}

void check(const vggtcd::Reconstruction& epoch) {
  vggtcd::check_consistent(epoch);
  for (const vggtcd::View& view : epoch.views) {
    require(view.camera_from_world.rotation.allFinite());
    require(view.camera_from_world.translation.allFinite());
    require(view.pinhole.fx > 0 && view.pinhole.fy > 0);
    require(!view.name.empty());
  }
  for (const float depth : epoch.depth) require(std::isfinite(depth) && depth >= 0);
  require(epoch.origin_in_world.allFinite());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const vggtcd::fuzz::FuzzDirectory directory;
  vggtcd::fuzz::FuzzInput input(data, size);
  const unsigned layout = input.byte(), sides = input.byte();
  Arrays arrays(1 + layout % 4, 1 + 3 * (sides % 8), 1 + 3 * (sides / 8 % 8), 3 + layout / 4 % 2);
  const std::string_view name = input.part().substr(0, 300);
  while (!input.rest().empty()) {
    std::vector<double>& array = *arrays.array(input.byte());
    const size_t at = input.byte() | size_t{input.byte()} << 8;
    array[at % array.size()] = number(input);
  }

  const std::filesystem::path path = directory.path() / "predictions.npz";
  const bool da3 = layout & 8, flat = layout & 16;
  const int64_t s = arrays.frames, h = arrays.height, w = arrays.width;
  const auto floats = [](const std::vector<double>& values) {
    return std::vector<float>(values.begin(), values.end());
  };
  const std::vector<float> depth = floats(arrays.depth), confidence = floats(arrays.confidence),
                           points = floats(arrays.points);
  const std::vector<std::string> names(static_cast<size_t>(s), std::string(name));
  vggtcd::NpzWriter npz(path);
  npz.add<double>(da3 ? "extrinsics" : "extrinsic", {s, arrays.pose_rows, 4}, arrays.poses);
  npz.add<double>(da3 ? "intrinsics" : "intrinsic", {s, 3, 3}, arrays.intrinsics);
  const std::vector<int64_t> plane{s, h, w}, planes{s, h, w, 1};
  npz.add<float>("depth", flat ? plane : planes, depth);
  if (layout & 32) npz.add<float>(da3 ? "conf" : "depth_conf", {s, h, w}, confidence);
  if (layout & 64) npz.add<float>("world_points", {s, h, w, 3}, points);
  if (layout & 128) npz.add_strings("names", names);
  npz.add<double>("keyframes_t1", {s}, arrays.keyframes);
  npz.add<double>("keyframes_t2", {s}, arrays.keyframes);
  npz.finish();

  try {
    const vggtcd::Reconstruction epoch =
        vggtcd::read_reconstruction(path, vggtcd::silent_progress());
    check(epoch);
    const auto joint = vggtcd::read_joint(path, epoch, epoch, vggtcd::silent_progress());
    check(joint.reconstruction);
  } catch (const vggtcd::Error& error) {
    require(error.code() == vggtcd::ErrorCode::kInput ||
            error.code() == vggtcd::ErrorCode::kDegenerate);
    vggtcd::fuzz::check_sentence(error);
  }
  return 0;
}
