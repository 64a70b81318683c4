// SPDX-License-Identifier: Apache-2.0
// Fuzz target: any bytes as the three files of a COLMAP model, binary (first byte even) or text.
#include "tests/fuzz/fuzz_files.h"
#include "vggtcd/io/colmap.h"

namespace {

using vggtcd::fuzz::require;

void check_pose(const vggtcd::Rigid3& pose) {
  require(pose.rotation.allFinite() && pose.translation.allFinite());
  const Eigen::Matrix3d product = pose.rotation * pose.rotation.transpose();
  require((product - Eigen::Matrix3d::Identity()).norm() < 1e-9);
}

void check_model(const vggtcd::ColmapModel& model) {
  for (const auto& [id, image] : model.images) {
    require(model.cameras.contains(image.camera_id));
    check_pose(image.camera_from_world);
  }
  for (const vggtcd::ColmapPoint& point : model.points) require(point.position.allFinite());
  require(vggtcd::colmap_trajectory(model).size() == model.images.size());
  for (const vggtcd::View& view : vggtcd::colmap_views(model)) {
    require(view.pinhole.width > 0 && view.pinhole.height > 0);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const vggtcd::fuzz::FuzzDirectory directory;
  constexpr const char* kNames[2][3] = {{"cameras.bin", "images.bin", "points3D.bin"},
                                        {"cameras.txt", "images.txt", "points3D.txt"}};
  vggtcd::fuzz::FuzzInput input(data, size);
  const size_t kind = input.byte() % 2;
  for (const char* other : kNames[1 - kind]) directory.remove(other);
  directory.write(kNames[kind][0], input.part());
  directory.write(kNames[kind][1], input.part());
  directory.write(kNames[kind][2], input.rest());
  try {
    check_model(vggtcd::read_colmap(directory.path()));
  } catch (const vggtcd::Error& error) {
    vggtcd::fuzz::check_refusal(error);
  }
  return 0;
}
