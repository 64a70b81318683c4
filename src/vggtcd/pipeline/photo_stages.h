// SPDX-License-Identifier: Apache-2.0
// From photos to the prediction files that detect reads, kept beside the results so that an
// interrupted or repeated job does not reconstruct twice.
#pragma once

#include <filesystem>

#include "vggtcd/pipeline/detect.h"
#include "vggtcd/reconstruction/choose_reconstructor.h"

namespace vggtcd {

struct PhotoInputs {
  std::string before, after;  // a folder, a pattern or a video each
  int frames = 0;             // per epoch at most; 0: all photos, 40 of a video
  ReconstructorOptions reconstruction;
};

// The photos of both epochs. Throws Error{kInput} for fewer than two photos on a side and for two
// sides with the same photos.
PhotoEpochs find_photo_epochs(const PhotoInputs& inputs, ProgressSink& progress);

// The plan, in words, for --dry-run.
std::string describe_plan(const PhotoInputs& inputs, ProgressSink& progress);

struct ReconstructedPhotos {
  EpochInputs inputs;       // before.npz, after.npz and joint.npz in OUT/.stages/KEY
  std::string explanation;  // how they were made
};

// Reconstructs unless OUT/.stages has the result for these photos and options already; KEY is a
// hash of the photos' bytes, their names and all that the reconstruction depends on.
ReconstructedPhotos reconstruct_photos(const PhotoInputs& inputs, const std::filesystem::path& out,
                                       ProgressSink& progress);

}  // namespace vggtcd
