// SPDX-License-Identifier: Apache-2.0
// Photos of two epochs to prediction files, for benchmarks that want several joint passes.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "vggtcd/core/progress.h"
#include "vggtcd/vggt/model.h"

namespace vggtcd {

struct JointPass {
  int keyframes = 5;  // per epoch; 0: all frames
  std::string file;   // "joint.npz"
};

struct PhotoPaths {
  std::vector<std::filesystem::path> before, after;
};

// Writes t1.npz, t2.npz and the joint passes into `directory`, by VGGT with these weights. What is
// there already is not made again, if photos.json says that it comes from the same photos (by their
// bytes) and network; else it is replaced. A joint pass that does not fit into memory is left out
// with a notice, but not the first one. Throws what reading photos and weights throws.
void predict_epochs(const PhotoPaths& photos, const std::filesystem::path& weights,
                    const VggtOptions& network, const std::vector<JointPass>& joints,
                    const std::filesystem::path& directory, ProgressSink& progress);

}  // namespace vggtcd
