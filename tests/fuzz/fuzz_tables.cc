// SPDX-License-Identifier: Apache-2.0
// Fuzz target: any bytes as a trajectory (TUM, NumPy poses) or a table of reference cameras; the
// first byte says which.
#include "tests/fuzz/fuzz_files.h"
#include "vggtcd/io/reference_cameras.h"
#include "vggtcd/io/trajectory.h"

namespace {

using vggtcd::fuzz::require;

void check_trajectory(const vggtcd::Trajectory& trajectory) {
  require(!trajectory.empty());
  for (const vggtcd::NamedPose& pose : trajectory) {
    require(pose.camera_from_world.rotation.allFinite());
    require(pose.camera_from_world.translation.allFinite());
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static const vggtcd::fuzz::FuzzDirectory directory;
  vggtcd::fuzz::FuzzInput input(data, size);
  constexpr const char* kNames[] = {"trajectory.tum", "cameras.csv", "poses.npy"};
  const size_t kind = input.byte() % std::size(kNames);
  const std::filesystem::path path = directory.write(kNames[kind], input.rest());
  try {
    if (kind == 1) {
      for (const vggtcd::ReferenceCamera& camera : vggtcd::read_reference_cameras(path)) {
        require(camera.center_m.allFinite());
      }
    } else {
      for (const auto convention :
           {vggtcd::PoseConvention::kCameraFromWorld, vggtcd::PoseConvention::kWorldFromCamera}) {
        check_trajectory(vggtcd::read_trajectory(path, convention));
      }
    }
  } catch (const vggtcd::Error& error) {
    vggtcd::fuzz::check_refusal(error);
  }
  return 0;
}
