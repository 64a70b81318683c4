// SPDX-License-Identifier: Apache-2.0
// From photos to prediction files: find, plan, reconstruct, keep.
#include "vggtcd/pipeline/photo_stages.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "vggtcd/core/parallel.h"
#include "vggtcd/core/timer.h"
#include "vggtcd/core/version.h"
#include "vggtcd/io/file_system.h"
#include "vggtcd/io/json_file.h"
#include "vggtcd/io/kept_files.h"
#include "vggtcd/io/output_directory.h"
#include "vggtcd/io/predictions.h"
#include "vggtcd/io/quote.h"
#include "vggtcd/pipeline/job_plan.h"
#include "vggtcd/scene/frame_image.h"

namespace vggtcd {
namespace {

namespace fs = std::filesystem;

EpochPhotos photos_of(const std::string& source, int frames, ProgressSink& progress) {
  EpochPhotos epoch;
  epoch.photos = find_photos(source, {.max_frames = frames, .read = {}}, progress);
  if (epoch.photos.size() < 2) {
    throw_error(
        ErrorCode::kInput,
        "{}: expected at least 2 different photos of the place, better 10 or more, found {}",
        source, epoch.photos.size());
  }
  return epoch;
}

// A prediction, and its images as photos of that epoch.
EpochPhotos prediction_of(const std::string& source, ProgressSink& progress) {
  if (!prediction_has_images(source)) {
    throw_error(ErrorCode::kInput,
                "{}: expected images in the prediction file, for they tell where it belongs among "
                "the photos of the other side; found none: save it with its images, or predict the "
                "other side as well and give --joint, --initial-sim3 or --aligned",
                source);
  }
  EpochPhotos epoch;
  const auto given = std::make_shared<const Reconstruction>(read_reconstruction(source, progress));
  for (int frame = 0; frame < given->num_frames(); ++frame) {
    auto image = std::make_shared<Image>(frame_image(*given, frame));
    epoch.photos.push_back({source, given->views[static_cast<size_t>(frame)].name, image});
  }
  epoch.given = given;
  return epoch;
}

// "photos/before/" -> "before"
std::string last_part(const std::string& source) {
  const fs::path path(source);
  return (path.has_filename() ? path : path.parent_path()).filename().string();
}

uint64_t fnv1a(const std::string& text) {
  uint64_t hash = 0xcbf29ce484222325u;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  return hash;
}

std::string stage_key(const PhotoEpochs& photos, const Reconstructor& reconstructor) {
  std::string all = fmt::format("{} {}\n", kVersion, reconstructor.fingerprint());
  for (const auto* epoch : {&photos.before, &photos.after}) {
    for (const PhotoRef& photo : epoch->photos) {
      all += fmt::format("{} {:016x}\n", photo.name, content_hash(photo));
    }
    if (epoch->given) {  // cameras take part in it as well
      const std::filesystem::path& file = epoch->photos.front().path;
      all += fmt::format("given {:016x}\n", content_hash({file, "", nullptr}));
    }
    all += "--\n";
  }
  return fmt::format("{}-{:016x}", reconstructor.name(), fnv1a(all));
}

// Written last: the stage is complete when it is there.
constexpr const char* kComplete = "reconstruction.json";
constexpr const char* kWork = "work";  // the reconstructor's own

// What reconstruct() leaves, all whole.
bool is_complete(const fs::path& kept, const PhotoEpochs& photos) {
  return is_kept(kept, kComplete) && is_kept(kept, kJointFile) &&
         (photos.before.given || is_kept(kept, kBeforeFile)) &&
         (photos.after.given || is_kept(kept, kAfterFile));
}

void note_damaged(const fs::path& kept, ProgressSink& progress) {
  for (const fs::path& folder : {kept, kept / kWork}) {
    for (const std::string& file : damaged_files(folder)) {
      progress.notice(fmt::format("{}: is damaged and made again", (folder / file).string()));
    }
  }
}

std::shared_ptr<const FileLock> lock_stages(const fs::path& out) {
  auto lock = FileLock::try_lock(out / kStages / "lock");
  if (!lock) {
    throw_error(ErrorCode::kOutput,
                "{}: another vggt-cd is working there; wait for it, or name another directory",
                out.string());
  }
  return std::make_shared<const FileLock>(std::move(*lock));
}

// Files that a killed run had not finished: of OutputFile (io/output_file.h), and of libzip, which
// adds a dot and six characters to an archive's name.
void remove_partial_files(const fs::path& folder) {
  std::vector<fs::path> partial;
  for (const fs::path& entry : list_tree(folder)) {
    const std::string name = entry.filename().string();
    const bool unfinished =
        name.find(".partial-") != std::string::npos || name.find(".npz.") != std::string::npos;
    if (is_file(entry) && unfinished) partial.push_back(entry);
  }
  for (const fs::path& path : partial) remove_tree(path);
}

JobSize job_size(const ReconstructionPlan& plan, const Reconstructor& reconstructor) {
  return {
      plan.frames_before, plan.frames_after, plan.width, plan.height,
      reconstructor.has_own_joint_pass() ? InitialSource::kOwnJointPass : InitialSource::kOneModel};
}

std::vector<PlannedStage> whole_job(const ReconstructionPlan& plan,
                                    const Reconstructor& reconstructor,
                                    const DetectOptions& options, bool votes) {
  std::vector<PlannedStage> stages = plan.stages;
  const std::vector<PlannedStage> results =
      plan_detect(job_size(plan, reconstructor), options, votes);
  stages.insert(stages.end(), results.begin(), results.end());
  return stages;
}

std::string memory_and_time(int64_t memory_bytes, const std::vector<PlannedStage>& stages) {
  return fmt::format(
      "Memory: about {:.1f} GB ({:.1f} GB available)\n"
      "Time: about {} with {} threads; other machines differ by a factor of two or three\n",
      static_cast<double>(memory_bytes) * 1e-9,
      static_cast<double>(available_memory_bytes()) * 1e-9, rough_duration(total_seconds(stages)),
      num_threads());
}

}  // namespace

PhotoEpochs find_photo_epochs(const PhotoInputs& inputs, ProgressSink& progress) {
  check_field(inputs.frames == 0 || inputs.frames >= 2, "frames", inputs.frames,
              "0 (all photos) or at least 2");
  const auto epoch = [&](const std::string& source) {
    return names_photos(source) ? photos_of(source, inputs.frames, progress)
                                : prediction_of(source, progress);
  };
  PhotoEpochs photos;
  photos.before = epoch(inputs.before);
  photos.after = epoch(inputs.after);
  std::set<uint64_t> before;
  for (const PhotoRef& photo : photos.before.photos) before.insert(content_hash(photo));
  std::vector<std::string> repeated;
  for (const PhotoRef& photo : photos.after.photos) {
    if (before.contains(content_hash(photo))) repeated.push_back(photo.name);
  }
  if (repeated.size() == photos.after.photos.size()) {
    throw_error(ErrorCode::kInput,
                "{} and {} hold the same {} photos; expected photos of two times", inputs.before,
                inputs.after, repeated.size());
  }
  if (!repeated.empty()) {
    progress.notice(fmt::format("photos of {} that are also in {} tell of no change: {}",
                                inputs.after, inputs.before, fmt::join(repeated, ", ")));
  }
  return photos;
}

std::string describe_plan(const PhotoInputs& inputs, const DetectOptions& options,
                          const fs::path& out, ProgressSink& progress) {
  OutputDirectory::check_usable(out, detect_contents(options));
  const PhotoEpochs photos = find_photo_epochs(inputs, progress);
  const auto reconstructor = choose_reconstructor(inputs.reconstruction, progress);
  ReconstructionPlan plan = reconstructor->plan(photos);
  const fs::path kept = out / kStages / stage_key(photos, *reconstructor);
  if (is_complete(kept, photos)) {
    plan.note = fmt::format("none: reconstruction of an earlier run is used again ({})",
                            escaped(kept.string()));
    plan.stages.clear();
    plan.memory_bytes = 0;
  } else {
    reconstructor->check_photos(photos, progress);
  }
  const bool votes = decides_by_votes(options, reconstructor->leaves_holes());
  const int64_t memory =
      std::max(plan.memory_bytes, detect_memory_bytes(job_size(plan, *reconstructor), votes));
  return fmt::format(
      "Reconstructor: {}\n"
      "Photos: {} before, {} after, {} in the joint reconstruction\n"
      "Frames: {} x {} px\n{}",
      plan.note, plan.frames_before, plan.frames_after, plan.frames_joint, plan.width, plan.height,
      memory_and_time(memory, whole_job(plan, *reconstructor, options, votes)));
}

std::string describe_plan(const EpochInputs& inputs, const DetectOptions& options,
                          const fs::path& out) {
  OutputDirectory::check_usable(out, detect_contents(options));
  const PredictionSize before = prediction_size(inputs.before);
  const PredictionSize after = prediction_size(inputs.after);
  const JobSize size{before.frames, after.frames, before.width, before.height,
                     inputs.joint ? InitialSource::kOwnJointPass : InitialSource::kGiven};
  const bool votes = decides_by_votes(options, false);
  return fmt::format(
      "Predictions: {} frames before, {} after\n"
      "Frames: {} x {} px before, {} x {} px after\n{}",
      before.frames, after.frames, before.width, before.height, after.width, after.height,
      memory_and_time(detect_memory_bytes(size, votes), plan_detect(size, options, votes)));
}

ReconstructedPhotos reconstruct_photos(const PhotoInputs& inputs, const DetectOptions& options,
                                       const fs::path& out, ProgressSink& progress) {
  OutputDirectory::check_usable(out, detect_contents(options));
  const PhotoEpochs photos = find_photo_epochs(inputs, progress);
  const auto reconstructor = choose_reconstructor(inputs.reconstruction, progress);
  OutputDirectory::claim(out, detect_contents(options));
  make_folder(out / kStages);
  ReconstructedPhotos done;
  done.lock = lock_stages(out);
  const fs::path kept = out / kStages / stage_key(photos, *reconstructor);
  const fs::path complete = kept / kComplete;
  if (is_complete(kept, photos)) {
    progress.notice(
        fmt::format("reconstruction of an earlier run is used again ({})", kept.string()));
  } else {
    make_folder(kept);
    remove_partial_files(kept);
    note_damaged(kept, progress);
    progress.job_planned(whole_job(reconstructor->plan(photos), *reconstructor, options,
                                   decides_by_votes(options, reconstructor->leaves_holes())));
    const std::string explanation = reconstructor->reconstruct(photos, kept, progress);
    write_json_file(complete,
                    Json{{"reconstructor", reconstructor->name()}, {"explanation", explanation}});
    keep(kept, kComplete);
  }
  remove_tree(kept / kWork);
  done.inputs.before = photos.before.given ? fs::path(inputs.before) : kept / kBeforeFile;
  done.inputs.after = photos.after.given ? fs::path(inputs.after) : kept / kAfterFile;
  done.inputs.joint = kept / kJointFile;
  done.inputs.before_name = last_part(inputs.before);
  done.inputs.after_name = last_part(inputs.after);
  done.explanation =
      json_member(read_json_file(complete), "explanation", complete.string()).get<std::string>();
  done.inputs.origin = done.explanation;
  done.inputs.has_holes = reconstructor->leaves_holes();
  done.inputs.own_joint_pass = reconstructor->has_own_joint_pass();
  return done;
}

}  // namespace vggtcd
