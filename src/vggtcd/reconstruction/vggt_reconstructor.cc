// SPDX-License-Identifier: Apache-2.0
// The paper's reconstruction: three passes of VGGT.
#include "vggtcd/reconstruction/vggt_reconstructor.h"

#include <algorithm>
#include <optional>

#include "vggtcd/io/predictions.h"
#include "vggtcd/io/weight_file.h"
#include "vggtcd/scene/keyframes.h"
#include "vggtcd/vggt/preprocess.h"

namespace vggtcd {
namespace {

std::vector<Image> fitted(const std::vector<PhotoRef>& photos, const ImageReadOptions& read) {
  std::vector<Image> images;
  for (const PhotoRef& photo : photos) {
    images.push_back(fit_photo(load_photo(photo, read), FitMode::kCrop, photo.name));
  }
  return images;
}

void require_one_size(const std::vector<Image>& images, const std::vector<PhotoRef>& photos,
                      const Image& model, const std::string& model_name) {
  for (size_t i = 0; i < images.size(); ++i) {
    if (images[i].width == model.width && images[i].height == model.height) continue;
    throw_error(ErrorCode::kInput,
                "{} becomes {} x {} px and {} {} x {} px; expected photos of one shape and "
                "orientation: turn, crop or leave out the others",
                photos[i].name, images[i].width, images[i].height, model_name, model.width,
                model.height);
  }
}

std::vector<std::string> names_of(const std::vector<PhotoRef>& photos) {
  std::vector<std::string> names;
  for (const PhotoRef& photo : photos) names.push_back(photo.name);
  return names;
}

VggtConfig config_of(const std::filesystem::path& weights) {
  WeightFile file = open_weight_file(weights);
  const auto config = file.metadata.find("config");
  const WeightStore store(std::move(file.tensors), weights.string());
  return read_config(store, config == file.metadata.end() ? "" : config->second);
}

// Loads the network only when a pass is not there already.
class Passes {
 public:
  Passes(const VggtReconstructorOptions& options, ProgressSink& progress)
      : options_(options), progress_(progress) {}

  Reconstruction run(std::span<const Image> images, std::vector<std::string> names) {
    if (!network_) {
      const ProgressStage stage(progress_, "weights");
      network_.emplace(Vggt::load(options_.weights, options_.network));
    }
    ImageBatch batch = make_batch(images, names, progress_);
    Reconstruction result = network_->reconstruct(batch, progress_).reconstruction;
    for (size_t i = 0; i < names.size(); ++i) result.views[i].name = names[i];
    return result;
  }

 private:
  const VggtReconstructorOptions& options_;
  ProgressSink& progress_;
  std::optional<Vggt> network_;
};

}  // namespace

std::string VggtReconstructor::fingerprint() const {
  // The weights by size and time: their contents are gigabytes.
  std::error_code failed;
  const auto size = std::filesystem::file_size(options_.weights, failed);
  const auto time = std::filesystem::last_write_time(options_.weights, failed);
  return fmt::format("vggt 1; weights {} {} {}; keyframes {}; precision {}",
                     std::filesystem::absolute(options_.weights).string(), failed ? 0 : size,
                     time.time_since_epoch().count(), options_.keyframes,
                     enum_to_string(options_.network.precision));
}

ReconstructionPlan VggtReconstructor::plan(const PhotoEpochs& photos) const {
  const VggtConfig config = config_of(options_.weights);
  const Image first =
      fit_photo(load_photo(photos.before.front(), photos.read), FitMode::kCrop, "photo");
  ReconstructionPlan plan;
  plan.frames_before = static_cast<int>(photos.before.size());
  plan.frames_after = static_cast<int>(photos.after.size());
  plan.frames_joint = std::min(options_.keyframes, plan.frames_before) +
                      std::min(options_.keyframes, plan.frames_after);
  plan.width = first.width;
  plan.height = first.height;
  const bool bf16 = options_.network.precision != Precision::kF32;
  double flop = 0;
  for (const int frames : {plan.frames_before, plan.frames_after, plan.frames_joint}) {
    const VggtRun run{.frames = frames, .height = first.height, .width = first.width, .bf16 = bf16};
    flop += cost_of(config, run).total_flop();
    plan.memory_bytes = std::max(plan.memory_bytes, memory_of(config, run).total());
  }
  constexpr double kFlopPerSecond = 4e11;  // two cores with AVX-512
  plan.seconds = flop / kFlopPerSecond;
  plan.note = fmt::format("vggt: three passes, {:.0f} TFLOP, taken at 0.4 TFLOP/s", flop * 1e-12);
  return plan;
}

EpochReconstructions VggtReconstructor::reconstruct(const PhotoEpochs& photos,
                                                    const std::filesystem::path& scratch,
                                                    ProgressSink& progress) const {
  const std::vector<Image> before = fitted(photos.before, photos.read);
  const std::vector<Image> after = fitted(photos.after, photos.read);
  require_one_size(before, photos.before, before.front(), photos.before.front().name);
  require_one_size(after, photos.after, before.front(), photos.before.front().name);
  const std::vector<std::string> names_t1 = names_of(photos.before),
                                 names_t2 = names_of(photos.after);
  std::filesystem::create_directories(scratch);
  Passes passes(options_, progress);
  EpochReconstructions result;
  // What is kept is what is used, in the first run as in a continued one: the same bytes.
  const auto epoch = [&](const char* file, const std::vector<Image>& images,
                         const std::vector<std::string>& names) {
    if (!std::filesystem::exists(scratch / file)) {
      write_reconstruction(scratch / file, passes.run(images, names));
    }
    return read_reconstruction(scratch / file, progress);
  };
  result.before = epoch("before.npz", before, names_t1);
  result.after = epoch("after.npz", after, names_t2);
  if (!std::filesystem::exists(scratch / "joint.npz")) {
    JointReconstruction joint;
    joint.keyframes_t1 = select_keyframes(static_cast<int>(before.size()), options_.keyframes);
    joint.keyframes_t2 = select_keyframes(static_cast<int>(after.size()), options_.keyframes);
    std::vector<Image> images;
    std::vector<std::string> names;
    const auto add = [&](const std::vector<int>& keyframes, const std::vector<Image>& from,
                         const std::vector<std::string>& their_names) {
      for (const int frame : keyframes) {
        images.push_back(from[static_cast<size_t>(frame)]);
        names.push_back(their_names[static_cast<size_t>(frame)]);
      }
    };
    add(joint.keyframes_t1, before, names_t1);
    add(joint.keyframes_t2, after, names_t2);
    joint.reconstruction = passes.run(images, names);
    write_joint(scratch / "joint.npz", joint);
  }
  result.joint = read_joint(scratch / "joint.npz", result.before, result.after, progress);
  result.explanation =
      fmt::format("Reconstructed by VGGT: {} and {} photos, {} + {} keyframes.", before.size(),
                  after.size(), result.joint.keyframes_t1.size(), result.joint.keyframes_t2.size());
  return result;
}

}  // namespace vggtcd
