// SPDX-License-Identifier: Apache-2.0
// From photos to the prediction files that detect reads, kept beside the results so that an
// interrupted or repeated job does not reconstruct twice.
#pragma once

#include <filesystem>

#include "vggtcd/io/file_lock.h"
#include "vggtcd/pipeline/detect.h"
#include "vggtcd/reconstruction/choose_reconstructor.h"

namespace vggtcd {

struct PhotoInputs {
  // A folder, a pattern or a video; or on one side a prediction file (.npz) with its images.
  std::string before, after;
  int frames = 0;  // per epoch at most; 0: all photos, 40 of a video
  ReconstructorOptions reconstruction;
};

// The photos of both epochs; of a prediction file its images, and itself. Throws Error{kUsage} for
// `frames` of 1, Error{kInput} for fewer than two photos on a side, for two sides with the same
// photos, and for a prediction file without images.
PhotoEpochs find_photo_epochs(const PhotoInputs& inputs, ProgressSink& progress);

// The plan of the whole job, in words, for --dry-run; a reconstruction that OUT/.stages keeps is
// not planned again. Reads all photos and throws what the job would throw for those that cannot be
// read or do not go together, and for an OUT that cannot take the results.
std::string describe_plan(const PhotoInputs& inputs, const DetectOptions& options,
                          const std::filesystem::path& out, ProgressSink& progress);
// The same for two prediction files.
std::string describe_plan(const EpochInputs& inputs, const DetectOptions& options,
                          const std::filesystem::path& out);

struct ReconstructedPhotos {
  EpochInputs inputs;       // before.npz, after.npz and joint.npz in OUT/.stages/KEY, or as given
  std::string explanation;  // how they were made
  std::shared_ptr<const FileLock> lock;  // while it lives, no other process works on OUT/.stages
};

// Reconstructs unless OUT/.stages has the result for these photos and options already; KEY is a
// hash of the photos' bytes, their names and all that the reconstruction depends on. What an
// interrupted run has finished there is used, what is damaged is made again. Throws Error{kOutput}
// while another process is at it.
// `options` are for the plan of the whole job that `progress` is told.
ReconstructedPhotos reconstruct_photos(const PhotoInputs& inputs, const DetectOptions& options,
                                       const std::filesystem::path& out, ProgressSink& progress);

}  // namespace vggtcd
