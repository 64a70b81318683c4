// SPDX-License-Identifier: Apache-2.0
// Vggt: the network: photos of one place -> cameras, depth and confidence in one frame; upstream
// vggt.models.vggt.VGGT.
//
//   const Vggt model = Vggt::load("model.safetensors", {});
//   const Prediction prediction = model.reconstruct(images);
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "vggtcd/core/options.h"
#include "vggtcd/core/progress.h"
#include "vggtcd/scene/reconstruction.h"
#include "vggtcd/vggt/camera_head.h"
#include "vggtcd/vggt/cost.h"
#include "vggtcd/vggt/dpt_head.h"
#include "vggtcd/vggt/precision.h"

namespace vggtcd {

struct VggtOptions {
  Precision precision = Precision::kAuto;
  bool depth_head = true;   // depth and its confidence; the camera head is always there
  bool point_head = false;  // world points and their confidence

  static constexpr auto fields = [](auto&& self, auto&& field) {
    field("precision", self.precision, kPrecisionHelp);
    field("depth_head", self.depth_head, "run the depth head");
    field("point_head", self.point_head, "run the point head too");
  };
};

// What one forward pass gives.
struct Prediction {
  Reconstruction reconstruction;         // without the depth head its depth is 0 throughout
  std::vector<PoseEncoding> pose_enc;    // [S]
  std::vector<float> world_points;       // [S, H, W, 3] in the world frame, empty unless asked for
  std::vector<float> world_points_conf;  // [S, H, W], likewise
  std::array<double, kNumVggtStages> seconds{};  // spent in each stage, indexed by VggtStage
};

class Vggt {
 public:
  // Reads a weights file: the official model.safetensors or model.pt, or a converted one; the file
  // is mapped and not needed afterwards. Throws what open_weight_file and from_tensors throw.
  static Vggt load(const std::filesystem::path& path, const VggtOptions& options);

  // Builds the network; all weights are copied, so the tensors may go away afterwards. source names
  // their file in errors; config_json: see read_config; release: see WeightStore. Throws
  // Error{kWeights} if a tensor that the options need is missing or misshapen, Error{kUsage} for a
  // precision that this processor does not have.
  static Vggt from_tensors(std::vector<TensorView> tensors, const std::string& config_json,
                           const std::string& source, const VggtOptions& options,
                           ReleaseWeights release = {});

  // One pass over all frames. Error{kInput} unless height and width are positive multiples of the
  // patch size. Same input, same bits, for any number of threads. One call at a time uses all
  // threads; the memory it needs is given back at the end.
  Prediction reconstruct(const ImageBatch& images, ProgressSink& progress = silent_progress(),
                         const Trace& trace = {}) const;

  const VggtConfig& config() const { return config_; }
  Precision precision() const { return precision_; }  // never kAuto
  // Tensors of the checkpoint that no upstream VGGT has, in file order.
  const std::vector<std::string>& superfluous() const { return superfluous_; }

 private:
  Vggt(const WeightStore& store, const std::string& config_json, const VggtOptions& options);
  void check_images(const ImageBatch& images) const;
  VggtRun run_of(const ImageBatch& images) const;
  void run_dense_heads(const ImageBatch& images, const AggregatedTokens& tokens,
                       Prediction& prediction, ProgressSink& progress, const Trace& trace) const;

  VggtConfig config_;
  Precision precision_;
  Aggregator aggregator_;
  CameraHead camera_head_;
  std::optional<DptHead> depth_head_, point_head_;
  std::vector<std::string> superfluous_;
};

}  // namespace vggtcd
