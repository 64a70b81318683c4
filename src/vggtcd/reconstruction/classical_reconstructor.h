// SPDX-License-Identifier: Apache-2.0
// The classical reconstruction: the fallback for when there are no network weights. COLMAP over
// both epochs at once gives the cameras, photos of the same epoch give the depth.
#pragma once

#include "vggtcd/reconstruction/dense_depth.h"
#include "vggtcd/reconstruction/reconstructor.h"
#include "vggtcd/reconstruction/trust.h"

namespace vggtcd {

struct ClassicalOptions {
  int keyframes = 5;        // per epoch, in the joint reconstruction
  int frame_side_px = 518;  // longer side of a frame, as the network's
  SfmOptions sfm;
  ViewSelectionOptions views;
  DenseDepthOptions depth;
  TrustOptions trust;
};

// Both epochs come out in COLMAP's common frame, so the joint reconstruction repeats their
// keyframes and the coarse stage of registration finds the identity. An epoch that is given takes
// part by its images: the joint reconstruction then holds the classical depth of its keyframes,
// which the coarse stage fits it to. Photos that COLMAP cannot place, and those without depth, are
// left out with a notice. Pixels without agreeing neighbours have no depth: unknown, not changed.
class ClassicalReconstructor : public Reconstructor {
 public:
  explicit ClassicalReconstructor(const ClassicalOptions& options) : options_(options) {}
  std::string name() const override { return "classical"; }
  bool leaves_holes() const override { return true; }
  bool has_own_joint_pass() const override { return false; }
  std::string fingerprint() const override;
  ReconstructionPlan plan(const PhotoEpochs& photos) const override;
  void check_photos(const PhotoEpochs& photos, ProgressSink& progress) const override;
  std::string reconstruct(const PhotoEpochs& photos, const std::filesystem::path& folder,
                          ProgressSink& progress) const override;

 private:
  ClassicalOptions options_;
};

}  // namespace vggtcd
