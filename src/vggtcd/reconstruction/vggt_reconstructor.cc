// SPDX-License-Identifier: Apache-2.0
// The paper's reconstruction: three passes of VGGT.
#include "vggtcd/reconstruction/vggt_reconstructor.h"

#include <algorithm>
#include <optional>

#include "vggtcd/core/cpu_features.h"
#include "vggtcd/core/interrupt.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/core/timer.h"
#include "vggtcd/io/file_system.h"
#include "vggtcd/io/kept_files.h"
#include "vggtcd/io/predictions.h"
#include "vggtcd/io/weight_file.h"
#include "vggtcd/io/weight_shards.h"
#include "vggtcd/nn/product_rate.h"
#include "vggtcd/scene/keyframes.h"
#include "vggtcd/vggt/memory_plan.h"
#include "vggtcd/vggt/preprocess.h"

namespace vggtcd {
namespace {

// Photos as the network reads them.
struct Frames {
  std::vector<Image> images;
  std::vector<std::string> names;
};

Image fitted(const PhotoRef& photo, const ImageReadOptions& read, int side,
             PhotoFacts* facts = nullptr) {
  return fit_photo(load_photo(photo, read, facts), FitMode::kCrop, photo.name, side);
}

// Reads frames epoch by epoch. The images of a given prediction are frames already.
class FrameReader {
 public:
  FrameReader(const ImageReadOptions& read, int side, size_t num_photos, ProgressStage& stage)
      : read_(read), side_(side), num_photos_(num_photos), stage_(stage) {}

  Frames read(const EpochPhotos& epoch, const char* name) {
    Frames frames;
    for (const PhotoRef& photo : epoch.photos) {
      throw_if_interrupted();
      PhotoFacts facts;
      frames.images.push_back(epoch.given ? load_photo(photo, read_)
                                          : fitted(photo, read_, side_, &facts));
      frames.names.push_back(photo.name);
      remarks_.add(fmt::format("{}/{}", name, photo.name), facts);
      stage_.advance(static_cast<double>(++done_) / static_cast<double>(num_photos_));
    }
    return frames;
  }
  const PhotoRemarks& remarks() const { return remarks_; }

 private:
  const ImageReadOptions& read_;
  int side_;
  size_t num_photos_, done_ = 0;
  ProgressStage& stage_;
  PhotoRemarks remarks_;
};

void require_one_size(const Frames& frames, const char* epoch, const Image& model,
                      const std::string& model_name) {
  for (size_t i = 0; i < frames.images.size(); ++i) {
    const Image& image = frames.images[i];
    if (image.width == model.width && image.height == model.height) continue;
    throw_error(ErrorCode::kInput,
                "{}/{} becomes {} x {} px and {} {} x {} px; expected photos of one shape and "
                "orientation: turn, crop or leave out the others",
                epoch, frames.names[i], image.width, image.height, model_name, model.width,
                model.height);
  }
}

// Both epochs, all frames of one size: that of a given prediction, else of the first photo.
std::pair<Frames, Frames> read_epochs(const PhotoEpochs& photos, int side, ProgressSink& progress) {
  ProgressStage stage(progress, "read photos");
  FrameReader reader(photos.read, side, photos.before.photos.size() + photos.after.photos.size(),
                     stage);
  Frames before = reader.read(photos.before, "before");
  Frames after = reader.read(photos.after, "after");
  reader.remarks().report(progress);
  const bool model_is_before = photos.before.given || !photos.after.given;
  const Frames& first = model_is_before ? before : after;
  const std::string model_name = (model_is_before ? "before/" : "after/") + first.names.front();
  require_one_size(before, "before", first.images.front(), model_name);
  require_one_size(after, "after", first.images.front(), model_name);
  return {std::move(before), std::move(after)};
}

int side_of(const PhotoEpochs& photos, int side, const VggtConfig& config) {
  const Reconstruction* given = photos.given();
  if (!given) return side;
  const int patch = static_cast<int>(config.patch_size);
  if (given->width % patch != 0 || given->height % patch != 0) {
    throw_error(
        ErrorCode::kInput,
        "the prediction file has frames of {} x {} px; the network reads sides that are "
        "multiples of {}: predict it again at such a size, or use --reconstructor classical",
        given->width, given->height, patch);
  }
  return given->width;
}

VggtConfig config_of(const std::filesystem::path& weights) {
  WeightFile file = open_weight_file(weights);
  const auto config = file.metadata.find("config");
  const WeightStore store(std::move(file.tensors), weights.string());
  return read_config(store, config == file.metadata.end() ? "" : config->second);
}

// The passes that have to be made, by their numbers of frames.
struct PassSizes {
  int before = 0, after = 0, joint = 0;
  int largest() const { return std::max({before, after, joint}); }
};

PassSizes pass_sizes(const PhotoEpochs& photos, int keyframes) {
  const int t1 = static_cast<int>(photos.before.photos.size());
  const int t2 = static_cast<int>(photos.after.photos.size());
  return {photos.before.given ? 0 : t1, photos.after.given ? 0 : t2,
          std::min(keyframes, t1) + std::min(keyframes, t2)};
}

// Loads the network only when a pass is not there already.
class Passes {
 public:
  Passes(const VggtReconstructorOptions& options, ProgressSink& progress)
      : options_(options), progress_(progress) {}

  Reconstruction run(const std::string& name, const Frames& frames) {
    if (!network_) {
      const ProgressStage stage(progress_, "weights");
      network_.emplace(Vggt::load(options_.weights, options_.network));
    }
    PrefixedProgress progress(progress_, name + ": ");
    const ImageBatch batch = make_batch(frames.images, frames.names, progress);
    Reconstruction result = network_->reconstruct(batch, progress).reconstruction;
    for (size_t i = 0; i < frames.names.size(); ++i) result.views[i].name = frames.names[i];
    return result;
  }

 private:
  const VggtReconstructorOptions& options_;
  ProgressSink& progress_;
  std::optional<Vggt> network_;
};

void append_keyframes(const Frames& from, const std::vector<int>& keyframes, Frames& to) {
  for (const int frame : keyframes) {
    to.images.push_back(from.images[static_cast<size_t>(frame)]);
    to.names.push_back(from.names[static_cast<size_t>(frame)]);
  }
}

}  // namespace

std::string VggtReconstructor::fingerprint() const {
  // The weights by size and time: their contents are gigabytes.
  std::string weights;
  for (const std::filesystem::path& file : weight_files(options_.weights)) {
    std::error_code failed;
    const auto size = std::filesystem::file_size(file, failed);
    const auto time = std::filesystem::last_write_time(file, failed);
    weights += fmt::format("{} {} {}; ", absolute_path(file).string(), failed ? 0 : size,
                           time.time_since_epoch().count());
  }
  return fmt::format("vggt 2; weights {}keyframes {}; side {}; precision {}", weights,
                     options_.keyframes, options_.frame_side_px,
                     enum_to_string(resolve_precision(options_.network.precision)));
}

ReconstructionPlan VggtReconstructor::plan(const PhotoEpochs& photos) const {
  const VggtConfig config = config_of(options_.weights);
  const bool from_after = photos.after.given && !photos.before.given;
  const EpochPhotos& model = from_after ? photos.after : photos.before;
  const Image first = model.given
                          ? load_photo(model.photos.front(), photos.read)
                          : fitted(model.photos.front(), photos.read, options_.frame_side_px);
  const PassSizes passes = pass_sizes(photos, options_.keyframes);
  ReconstructionPlan plan;
  plan.frames_before = static_cast<int>(photos.before.photos.size());
  plan.frames_after = static_cast<int>(photos.after.photos.size());
  plan.frames_joint = passes.joint;
  plan.width = first.width;
  plan.height = first.height;
  const Precision precision = resolve_precision(options_.network.precision);
  const double product_flop_per_s = measure_product_rate(product_types(precision));
  // Of the rate of products alone, by all that the network does (docs/performance.md).
  constexpr double kNetworkShare = 0.85;
  const double flop_per_s = kNetworkShare * product_flop_per_s;
  constexpr double kReadSecondsPerPhoto = 0.05, kWeightsSeconds = 1.5;
  constexpr double kFrameSeconds = 0.05;  // outside of the products, of a small network
  plan.stages = {{"read photos", kReadSecondsPerPhoto * (plan.frames_before + plan.frames_after)},
                 {"weights", kWeightsSeconds}};
  double flop = 0;
  struct Pass {
    const char* name;
    int frames;
  };
  for (const Pass& pass :
       {Pass{"before", passes.before}, Pass{"after", passes.after}, Pass{"joint", passes.joint}}) {
    if (pass.frames == 0) continue;
    const VggtRun run{.frames = pass.frames,
                      .height = first.height,
                      .width = first.width,
                      .precision = precision};
    const VggtCost cost = cost_of(config, run);
    flop += cost.total_flop();
    plan.memory_bytes = std::max(plan.memory_bytes, memory_of(config, run).total());
    const auto add = [&](std::string_view stage, double stage_flop, double others) {
      plan.stages.push_back(
          {fmt::format("{}: {}", pass.name, stage), others + stage_flop / flop_per_s});
    };
    const double cameras = cost.flop_of(VggtStage::kCameras);
    const double depth = cost.flop_of(VggtStage::kDepth);
    add("network", cost.total_flop() - cameras - depth, 0);
    add(stage_name(VggtStage::kCameras), cameras, 0);
    add(stage_name(VggtStage::kDepth), depth, kFrameSeconds * pass.frames);
  }
  std::vector<const PhotoRef*> all;  // read one after another
  for (const EpochPhotos* epoch : {&photos.before, &photos.after}) {
    for (const PhotoRef& photo : epoch->photos) all.push_back(&photo);
  }
  constexpr int64_t kFixedBytes = 100'000'000;
  plan.memory_bytes = std::max(plan.memory_bytes, largest_decode_bytes(all) + kFixedBytes);
  plan.note = fmt::format(
      "vggt: {:.1f} TFLOP in {} passes, precision {} on {}; products measured here: {:.2f} TFLOP/s "
      "on {} threads",
      flop * 1e-12, (passes.before > 0) + (passes.after > 0) + 1, enum_to_string(precision),
      enum_to_string(cpu_level()), product_flop_per_s * 1e-12, num_threads());
  return plan;
}

void VggtReconstructor::check_photos(const PhotoEpochs& photos, ProgressSink& progress) const {
  const int side = side_of(photos, options_.frame_side_px, config_of(options_.weights));
  read_epochs(photos, side, progress);
}

std::string VggtReconstructor::reconstruct(const PhotoEpochs& photos,
                                           const std::filesystem::path& folder,
                                           ProgressSink& progress) const {
  const VggtConfig config = config_of(options_.weights);
  const int side = side_of(photos, options_.frame_side_px, config);
  const std::pair<Frames, Frames> epochs = read_epochs(photos, side, progress);
  const Frames& before = epochs.first;
  const Frames& after = epochs.second;
  const PassSizes passes_to_run = pass_sizes(photos, options_.keyframes);
  const Image& model = before.images.front();
  throw_unless_fits(plan_memory(config,
                                {.frames = passes_to_run.largest(),
                                 .height = model.height,
                                 .width = model.width,
                                 .precision = resolve_precision(options_.network.precision)},
                                available_memory_bytes()));

  Passes passes(options_, progress);
  const auto epoch = [&](const char* name, const char* file, const EpochPhotos& of,
                         const Frames& frames) {
    if (of.given || is_kept(folder, file)) return;
    write_reconstruction(folder / file, passes.run(name, frames));
    keep(folder, file);
  };
  epoch("before", kBeforeFile, photos.before, before);
  epoch("after", kAfterFile, photos.after, after);
  JointReconstruction joint;
  joint.keyframes_t1 = select_keyframes(static_cast<int>(before.images.size()), options_.keyframes);
  joint.keyframes_t2 = select_keyframes(static_cast<int>(after.images.size()), options_.keyframes);
  if (!is_kept(folder, kJointFile)) {
    Frames keyframes;
    append_keyframes(before, joint.keyframes_t1, keyframes);
    append_keyframes(after, joint.keyframes_t2, keyframes);
    joint.reconstruction = passes.run("joint", keyframes);
    joint.keyframes_t1 = numbers_in_file(photos.before, joint.keyframes_t1);
    joint.keyframes_t2 = numbers_in_file(photos.after, joint.keyframes_t2);
    write_joint(folder / kJointFile, joint);
    keep(folder, kJointFile);
  }
  const auto made = [](const EpochPhotos& of) {
    return fmt::format("{} {}", of.photos.size(), of.given ? "given frames" : "photos");
  };
  return fmt::format("Reconstructed by VGGT: {} before, {} after, {} + {} keyframes.",
                     made(photos.before), made(photos.after), joint.keyframes_t1.size(),
                     joint.keyframes_t2.size());
}

}  // namespace vggtcd
