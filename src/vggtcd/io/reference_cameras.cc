// SPDX-License-Identifier: Apache-2.0
// Where cameras are known to have stood.
#include "vggtcd/io/reference_cameras.h"

#include <algorithm>
#include <set>

#include "vggtcd/core/error.h"
#include "vggtcd/io/camera_table.h"
#include "vggtcd/io/failure.h"
#include "vggtcd/io/file_system.h"
#include "vggtcd/io/quote.h"
#include "vggtcd/io/trajectory.h"

namespace vggtcd {
namespace {

namespace fs = std::filesystem;

std::vector<ReferenceCamera> read_model(const fs::path& path) {
  std::vector<ReferenceCamera> cameras;
  for (const NamedPose& pose : read_trajectory(path, PoseConvention::kCameraFromWorld)) {
    cameras.push_back({pose.name, camera_center(pose.camera_from_world)});
  }
  return cameras;
}

}  // namespace

std::vector<ReferenceCamera> read_reference_cameras(const fs::path& path) try {
  const bool is_model =
      is_folder(path) || path.filename() == "images.txt" || path.filename() == "images.bin";
  std::vector<ReferenceCamera> cameras = is_model ? read_model(path) : read_camera_table(path);
  std::set<std::string> names;
  for (const ReferenceCamera& camera : cameras) {
    if (names.insert(camera.name).second) continue;
    throw_error(ErrorCode::kInput, "{}: expected every camera once, found {} twice", path.string(),
                quote(camera.name));
  }
  if (cameras.empty()) {
    throw_error(ErrorCode::kInput,
                "{}: expected camera positions (name x y z, TUM, or a COLMAP model), found none",
                path.string());
  }
  return cameras;
} catch (...) {
  rethrow_naming(path);
}

}  // namespace vggtcd
