// SPDX-License-Identifier: Apache-2.0
// The list of reconstructors, and which one a user gets.
#include "vggtcd/reconstruction/choose_reconstructor.h"

#include <cstdlib>

#include "vggtcd/io/file_system.h"
#include "vggtcd/io/weight_shards.h"
#include "vggtcd/reconstruction/classical_reconstructor.h"
#include "vggtcd/reconstruction/vggt_reconstructor.h"

namespace vggtcd {
namespace {

constexpr const char* kWithoutWeights = "detect also works without (--reconstructor classical)";

}  // namespace

std::span<const EnumName<ReconstructorKind>> enum_names(ReconstructorKind) {
  static constexpr EnumName<ReconstructorKind> kNames[] = {
      {ReconstructorKind::kAuto, "auto"},
      {ReconstructorKind::kVggt, "vggt"},
      {ReconstructorKind::kClassical, "classical"}};
  return kNames;
}

void ReconstructorOptions::validate() const {
  check_field(keyframes >= 1, "keyframes", keyframes, "at least 1");
  check_field(frame_side >= 56 && frame_side <= 1036 && frame_side % 14 == 0, "frame_side",
              frame_side, "a multiple of 14 from 56 to 1036");
}

std::string find_weights(const std::string& given) {
  if (!given.empty()) return given;
  if (const char* named = std::getenv("VGGTCD_WEIGHTS"); named && *named) return named;
  const char* home = std::getenv("HOME");
  const auto usual =
      std::filesystem::path(home ? home : "") / ".local/share/vggt-cd/model.safetensors";
  return is_file(usual) ? usual.string() : std::string();
}

std::filesystem::path require_weights(const std::string& given) {
  const std::string weights = find_weights(given);
  if (weights.empty()) {
    throw_error(ErrorCode::kWeights,
                "no network weights: expected --weights FILE, VGGTCD_WEIGHTS or "
                "~/.local/share/vggt-cd/model.safetensors; {}",
                kWithoutWeights);
  }
  if (!is_file(weights) && !is_folder(weights)) {
    throw_error(ErrorCode::kWeights, "{}{}: expected network weights, found {}; {}",
                given.empty() ? "VGGTCD_WEIGHTS: " : "", weights, what_stands_at(weights),
                kWithoutWeights);
  }
  return weight_path(weights);  // of a folder
}

std::unique_ptr<Reconstructor> choose_reconstructor(const ReconstructorOptions& options,
                                                    ProgressSink& progress) {
  options.validate();
  ReconstructorKind kind = options.reconstructor;
  const std::string weights =
      kind == ReconstructorKind::kClassical ? std::string() : find_weights(options.weights);
  if (kind == ReconstructorKind::kAuto && weights.empty()) {
    progress.notice(
        "no network weights (--weights): classical reconstruction, which needs ten or more "
        "overlapping photos of textured surfaces per epoch");
    kind = ReconstructorKind::kClassical;
  }
  if (kind == ReconstructorKind::kClassical) {
    ClassicalOptions classical;
    classical.keyframes = options.keyframes;
    classical.frame_side_px = options.frame_side;
    return std::make_unique<ClassicalReconstructor>(classical);
  }
  VggtReconstructorOptions vggt;
  vggt.weights = require_weights(options.weights);
  vggt.keyframes = options.keyframes;
  vggt.frame_side_px = options.frame_side;
  vggt.network.precision = options.precision;
  return std::make_unique<VggtReconstructor>(vggt);
}

}  // namespace vggtcd
