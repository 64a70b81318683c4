// SPDX-License-Identifier: Apache-2.0
// Reconstruction -> a prediction file with VGGT's keys.
#include "vggtcd/io/npz.h"
#include "vggtcd/io/predictions.h"
#include "vggtcd/scene/local_frame.h"

namespace vggtcd {
namespace {

void write(const std::filesystem::path& path, const Reconstruction& reconstruction,
           const JointReconstruction* joint) {
  check_consistent(reconstruction);
  const int64_t s = reconstruction.num_frames();
  const int64_t h = reconstruction.height, w = reconstruction.width;
  using RowMajor34 = Eigen::Matrix<double, 3, 4, Eigen::RowMajor>;
  using RowMajor33 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  std::vector<double> poses(static_cast<size_t>(s) * 12), intrinsics(static_cast<size_t>(s) * 9);
  std::vector<std::string> names;
  for (size_t i = 0; i < reconstruction.views.size(); ++i) {
    const View& view = reconstruction.views[i];
    Eigen::Map<RowMajor34> pose(poses.data() + i * 12);
    const Rigid3 in_world =
        camera_from_world(view.camera_from_world, reconstruction.origin_in_world);
    pose.leftCols<3>() = in_world.rotation;
    pose.col(3) = in_world.translation;
    Eigen::Map<RowMajor33>(intrinsics.data() + i * 9) = view.pinhole.matrix();
    names.push_back(view.name);
  }
  NpzWriter npz(path);
  npz.add<double>("extrinsic", {s, 3, 4}, poses);
  npz.add<double>("intrinsic", {s, 3, 3}, intrinsics);
  npz.add<float>("depth", {s, h, w, 1}, reconstruction.depth);
  npz.add<float>("depth_conf", {s, h, w}, reconstruction.confidence);
  npz.add<uint8_t>("images", {s, h, w, 3}, reconstruction.color);
  npz.add_strings("names", names);
  std::vector<int64_t> keyframes_t1, keyframes_t2;
  if (joint != nullptr) {
    keyframes_t1.assign(joint->keyframes_t1.begin(), joint->keyframes_t1.end());
    keyframes_t2.assign(joint->keyframes_t2.begin(), joint->keyframes_t2.end());
    npz.add<int64_t>("keyframes_t1", {static_cast<int64_t>(keyframes_t1.size())}, keyframes_t1);
    npz.add<int64_t>("keyframes_t2", {static_cast<int64_t>(keyframes_t2.size())}, keyframes_t2);
  }
  npz.finish();
}

}  // namespace

void write_reconstruction(const std::filesystem::path& path, const Reconstruction& reconstruction) {
  write(path, reconstruction, nullptr);
}

void write_joint(const std::filesystem::path& path, const JointReconstruction& joint) {
  write(path, joint.reconstruction, &joint);
}

}  // namespace vggtcd
