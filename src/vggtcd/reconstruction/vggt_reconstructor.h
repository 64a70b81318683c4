// SPDX-License-Identifier: Apache-2.0
// The paper's reconstruction: VGGT over each epoch, and over keyframes of both (section 3.1
// and 3.2).
#pragma once

#include "vggtcd/reconstruction/reconstructor.h"
#include "vggtcd/vggt/model.h"

namespace vggtcd {

struct VggtReconstructorOptions {
  std::filesystem::path weights;
  int keyframes = 5;  // per epoch, in the joint pass
  VggtOptions network;
};

// Three passes, each kept in the scratch folder as a prediction file and not made again.
class VggtReconstructor : public Reconstructor {
 public:
  explicit VggtReconstructor(VggtReconstructorOptions options) : options_(std::move(options)) {}
  std::string name() const override { return "vggt"; }
  bool leaves_holes() const override { return false; }
  std::string fingerprint() const override;
  ReconstructionPlan plan(const PhotoEpochs& photos) const override;
  EpochReconstructions reconstruct(const PhotoEpochs& photos, const std::filesystem::path& scratch,
                                   ProgressSink& progress) const override;

 private:
  VggtReconstructorOptions options_;
};

}  // namespace vggtcd
