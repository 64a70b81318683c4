// SPDX-License-Identifier: Apache-2.0
// batch_file: shapes and checks; the container is io/npz.
#include "vggtcd/vggt/batch_file.h"

#include <algorithm>
#include <cmath>

#include "vggtcd/core/error.h"
#include "vggtcd/io/npz.h"

namespace vggtcd {
namespace {

// Camera-from-world [R | t], rows first; and the intrinsic matrix.
struct Cameras {
  std::vector<float> extrinsic, intrinsic;  // [S, 3, 4], [S, 3, 3]

  explicit Cameras(const std::vector<View>& views) {
    for (const View& view : views) {
      const Rigid3& pose = view.camera_from_world;
      const Eigen::Matrix3d matrix = view.pinhole.matrix();
      for (int row = 0; row < 3; ++row) {
        for (int column = 0; column < 3; ++column) {
          extrinsic.push_back(static_cast<float>(pose.rotation(row, column)));
          intrinsic.push_back(static_cast<float>(matrix(row, column)));
        }
        extrinsic.push_back(static_cast<float>(pose.translation[row]));
      }
    }
  }
};

}  // namespace

ImageBatch read_image_batch(const std::filesystem::path& path) {
  const NpzReader npz(path);
  if (!npz.has("images")) {
    throw_error(ErrorCode::kInput,
                "{}: expected the key images (S, 3, H, W) with values in [0, 1], found no such key",
                path.string());
  }
  npz.expect_shape("images", std::array<int64_t, 4>{-1, 3, -1, -1});
  const std::vector<int64_t>& shape = npz.header("images").shape;
  ImageBatch batch;
  batch.frames = shape[0];
  batch.height = shape[2];
  batch.width = shape[3];
  batch.pixels = npz.read<float>("images");
  constexpr float kSlack = 1e-3f;  // resizing in floating point overshoots a little
  const auto outside = std::ranges::find_if(batch.pixels, [](float value) {
    return !(value >= -kSlack && value <= 1 + kSlack);  // NaN, too
  });
  if (outside != batch.pixels.end()) {
    throw_error(ErrorCode::kInput,
                "{}: images: expected values in [0, 1], found {}; divide 8-bit values by 255",
                path.string(), *outside);
  }
  if (npz.has("names")) {
    batch.names = npz.read_strings("names");
    if (std::ssize(batch.names) != batch.frames) {
      throw_error(ErrorCode::kInput, "{}: expected {} names, found {}", path.string(), batch.frames,
                  batch.names.size());
    }
  }
  return batch;
}

void write_prediction(const std::filesystem::path& path, const ImageBatch& images,
                      const Prediction& prediction) {
  const Reconstruction& r = prediction.reconstruction;
  const int64_t s = r.num_frames(), h = r.height, w = r.width;
  const Cameras cameras(r.views);
  std::vector<float> pose_enc;
  for (const PoseEncoding& pose : prediction.pose_enc) {
    pose_enc.insert(pose_enc.end(), pose.begin(), pose.end());
  }
  std::vector<std::string> names;
  for (const View& view : r.views) names.push_back(view.name);

  NpzWriter npz(path);
  const auto add = [&](const char* key, std::vector<int64_t> shape,
                       const std::vector<float>& values) {
    npz.add<float>(key, std::move(shape), values);
  };
  add("pose_enc", {s, 9}, pose_enc);
  add("extrinsic", {s, 3, 4}, cameras.extrinsic);
  add("intrinsic", {s, 3, 3}, cameras.intrinsic);
  add("depth", {s, h, w, 1}, r.depth);
  add("depth_conf", {s, h, w}, r.confidence);
  if (!prediction.world_points.empty()) {
    add("world_points", {s, h, w, 3}, prediction.world_points);
    add("world_points_conf", {s, h, w}, prediction.world_points_conf);
  }
  add("images", {s, 3, h, w}, images.pixels);
  npz.add_strings("names", names);
  npz.finish();
}

}  // namespace vggtcd
