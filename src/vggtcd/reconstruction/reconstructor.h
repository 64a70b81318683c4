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

// One epoch of a job: photos, or a prediction that is there already and holds its photos.
struct EpochPhotos {
  std::vector<PhotoRef> photos;
  std::shared_ptr<const Reconstruction> given;  // frame k is photo k; null: to be made
};

struct PhotoEpochs {
  EpochPhotos before, after;
  ImageReadOptions read;

  // The prediction that decides the size of all frames, if there is one.
  const Reconstruction* given() const {
    return before.given ? before.given.get() : after.given.get();
  }
};

// What reconstruct() would do, for --dry-run.
struct ReconstructionPlan {
  int frames_before = 0, frames_after = 0, frames_joint = 0;
  int width = 0, height = 0;         // of a frame
  int64_t memory_bytes = 0;          // estimated peak
  std::vector<PlannedStage> stages;  // with estimated times
  std::string note;                  // what will be done, and what the estimate of time stands on
};

// What reconstruct() leaves in its folder, prediction files (docs/formats.md).
inline constexpr const char* kBeforeFile = "before.npz";
inline constexpr const char* kAfterFile = "after.npz";
inline constexpr const char* kJointFile = "joint.npz";

class Reconstructor {
 public:
  virtual ~Reconstructor() = default;
  virtual std::string name() const = 0;  // "vggt", "classical"
  // Whether depth is missing where it was hard to find; a hole is unknown, never changed.
  virtual bool leaves_holes() const = 0;
  // The joint reconstruction is another estimate, in another frame, than the epochs' own.
  virtual bool has_own_joint_pass() const = 0;
  virtual std::string fingerprint() const = 0;  // all that its result depends on besides the photos
  // Decodes no more than one photo; reads the headers of all.
  virtual ReconstructionPlan plan(const PhotoEpochs& photos) const = 0;
  // Reads all photos and throws what reconstruct() would throw before its long stages: for a photo
  // that cannot be decoded, and for photos that do not go together.
  virtual void check_photos(const PhotoEpochs& photos, ProgressSink& progress) const = 0;
  // Writes before.npz and after.npz, of the epochs that are not given, and joint.npz into `folder`,
  // and keeps each when it is complete (io/kept_files.h); what an earlier call with the same photos
  // and fingerprint kept there is used. Files and folders of other names there are its own. Same
  // photos and fingerprint, same bytes, whether interrupted or not. Returns one sentence: what was
  // done and how far it can be trusted. Throws Error{kDegenerate} with the reason when the photos
  // do not carry a reconstruction that can be trusted.
  virtual std::string reconstruct(const PhotoEpochs& photos, const std::filesystem::path& folder,
                                  ProgressSink& progress) const = 0;
};

// Puts a prefix before the names of stages: "before: depth".
class PrefixedProgress : public ProgressSink {
 public:
  PrefixedProgress(ProgressSink& sink, std::string prefix)
      : sink_(sink), prefix_(std::move(prefix)) {}
  void stage_started(std::string_view stage) override { sink_.stage_started(named(stage)); }
  void stage_advanced(std::string_view stage, double fraction) override {
    sink_.stage_advanced(named(stage), fraction);
  }
  void stage_finished(std::string_view stage, double seconds) override {
    sink_.stage_finished(named(stage), seconds);
  }
  void notice(std::string_view message) override { sink_.notice(message); }
  void job_planned(const std::vector<PlannedStage>& stages) override { sink_.job_planned(stages); }

 private:
  std::string named(std::string_view stage) const { return prefix_ + std::string(stage); }
  ProgressSink& sink_;
  std::string prefix_;
};

// Keyframes as a prediction file names them: of a given epoch by their numbers in its file.
std::vector<int> numbers_in_file(const EpochPhotos& epoch, const std::vector<int>& keyframes);

// The joint reconstruction of epochs that are in one frame already: copies of their keyframes.
JointReconstruction joint_of_keyframes(const Reconstruction& before, const Reconstruction& after,
                                       int keyframes);

}  // namespace vggtcd
