// SPDX-License-Identifier: Apache-2.0
// The paper's reconstruction: VGGT over each epoch, and over keyframes of both (section 3.1
// and 3.2).
#pragma once

#include "vggtcd/reconstruction/reconstructor.h"
#include "vggtcd/vggt/model.h"

namespace vggtcd {

struct VggtReconstructorOptions {
  std::filesystem::path weights;
  int keyframes = 5;        // per epoch, in the joint pass
  int frame_side_px = 518;  // longer side of a frame, a multiple of 14
  VggtOptions network;
};

// A pass over each epoch that is not given, and one over keyframes of both. Photos beside a given
// prediction are fitted to the size of its frames.
class VggtReconstructor : public Reconstructor {
 public:
  explicit VggtReconstructor(VggtReconstructorOptions options) : options_(std::move(options)) {}
  std::string name() const override { return "vggt"; }
  bool leaves_holes() const override { return false; }
  bool has_own_joint_pass() const override { return true; }
  std::string fingerprint() const override;
  ReconstructionPlan plan(const PhotoEpochs& photos) const override;
  void check_photos(const PhotoEpochs& photos, ProgressSink& progress) const override;
  std::string reconstruct(const PhotoEpochs& photos, const std::filesystem::path& folder,
                          ProgressSink& progress) const override;

 private:
  VggtReconstructorOptions options_;
};

}  // namespace vggtcd
