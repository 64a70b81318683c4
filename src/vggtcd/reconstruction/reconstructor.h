// SPDX-License-Identifier: Apache-2.0
// Reconstructor: the seam between photos and change detection. Whatever turns two lists of photos
// into two reconstructed epochs and what ties them together is one class behind this interface, one
// file in this folder, and one line in make_reconstructor.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "vggtcd/core/options.h"
#include "vggtcd/core/progress.h"
#include "vggtcd/io/photo_source.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

struct PhotoEpochs {
  std::vector<PhotoRef> before, after;
  ImageReadOptions read;
};

// What reconstruct() would do, for --dry-run.
struct ReconstructionPlan {
  int frames_before = 0, frames_after = 0, frames_joint = 0;
  int width = 0, height = 0;  // of a frame
  int64_t memory_bytes = 0;   // estimated peak
  double seconds = 0;         // estimated, on two cores of 2024
  std::string note;           // a sentence on what the estimate stands on
};

struct EpochReconstructions {
  Reconstruction before, after;
  JointReconstruction joint;
  std::string explanation;  // one sentence: what was done and how far it can be trusted
};

class Reconstructor {
 public:
  virtual ~Reconstructor() = default;
  virtual std::string name() const = 0;  // "vggt", "classical"
  // Whether depth is missing where it was hard to find; a hole is unknown, never changed.
  virtual bool leaves_holes() const = 0;
  virtual std::string fingerprint() const = 0;  // all that its result depends on besides the photos
  virtual ReconstructionPlan plan(const PhotoEpochs& photos) const = 0;
  // `scratch` is a folder of its own for working files. Same photos and fingerprint, same result.
  // Throws Error{kDegenerate} with the reason when the photos do not carry a reconstruction that
  // can be trusted.
  virtual EpochReconstructions reconstruct(const PhotoEpochs& photos,
                                           const std::filesystem::path& scratch,
                                           ProgressSink& progress) const = 0;
};

// The joint reconstruction of epochs that are in one frame already: copies of their keyframes.
JointReconstruction joint_of_keyframes(const Reconstruction& before, const Reconstruction& after,
                                       int keyframes);

}  // namespace vggtcd
