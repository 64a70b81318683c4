// SPDX-License-Identifier: Apache-2.0
// Inside of predictions.h: where a prediction file keeps what, and the check of its poses.
#pragma once

#include <cstdint>
#include <string>

#include "vggtcd/core/progress.h"
#include "vggtcd/io/npz.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd::internal {

// Keys are empty where the file has no such array.
struct PredictionLayout {
  std::string poses, intrinsics, confidence, images, world_points;
  bool world_from_camera = false;  // what the poses mean; otherwise camera-from-world
  bool points_are_exact = false;   // world_points were computed from depth and poses
  int64_t frames = 0, height = 0, width = 0;
};

// Compares world points, where the file has them, with depth and poses at about 10 000 pixels,
// reading the poses both as the layout says and the other way round. Throws Error{kInput} if the
// other way explains the points and ours does not, or if exact points agree with neither; points
// of a separate network head that agree with neither are a notice.
void verify_poses(const NpzReader& npz, const PredictionLayout& layout,
                  const Reconstruction& reconstruction, ProgressSink& progress);

// Depths that are no part of the scene become 0, with one notice (scene/stray_depths.h): one pixel
// must not decide where the scene ends.
void drop_strays(const std::string& name, Reconstruction& reconstruction, ProgressSink& progress);

// Into a local frame, where the file's origin is far away (scene/local_frame.h). A notice says
// when the file's poses have too few digits for that.
void move_near(const NpzReader& npz, const PredictionLayout& layout, Reconstruction& reconstruction,
               ProgressSink& progress);

}  // namespace vggtcd::internal
