// SPDX-License-Identifier: Apache-2.0
// The list of reconstructors, and which one a user gets.
#pragma once

#include "vggtcd/reconstruction/reconstructor.h"
#include "vggtcd/vggt/model.h"

namespace vggtcd {

enum class ReconstructorKind { kAuto, kVggt, kClassical };
std::span<const EnumName<ReconstructorKind>> enum_names(ReconstructorKind);

struct ReconstructorOptions {
  ReconstructorKind reconstructor = ReconstructorKind::kAuto;
  std::string weights;
  int keyframes = 5;
  int frame_side = 518;
  Precision precision = Precision::kAuto;

  static constexpr auto fields = [](auto&& self, auto&& field) {
    field("reconstructor", self.reconstructor,
          "vggt: the network. classical: COLMAP and plane-sweep depth, the fallback without "
          "weights. auto: vggt if weights are given or found, else classical.");
    field("weights", self.weights,
          "VGGT's weights, model.safetensors or model.pt. Without it the file named by "
          "VGGTCD_WEIGHTS, then ~/.local/share/vggt-cd/model.safetensors.");
    field("keyframes", self.keyframes, "Photos per epoch in the joint reconstruction; at least 1.");
    field("frame_side", self.frame_side,
          "Longer side of a frame, px, a multiple of 14; 518 is what the network was trained with. "
          "Smaller is faster and coarser. A prediction file on one side decides it.");
    field("precision", self.precision, kPrecisionHelp);
  };
  void validate() const;
};

// The weights file that is meant: `given`, else VGGTCD_WEIGHTS, else the usual place; empty if
// there is none in any of them.
std::string find_weights(const std::string& given);

// The same. Throws Error{kWeights} if there is none or no such file.
std::filesystem::path require_weights(const std::string& given);

// Throws Error{kWeights} if vggt is asked for and no weights are given or found. In auto,
// `progress` gets a notice when it is the fallback.
std::unique_ptr<Reconstructor> choose_reconstructor(const ReconstructorOptions& options,
                                                    ProgressSink& progress);

}  // namespace vggtcd
