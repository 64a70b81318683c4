// SPDX-License-Identifier: Apache-2.0
// From photos to prediction files: find, plan, reconstruct, keep.
#include "vggtcd/pipeline/photo_stages.h"

#include <algorithm>
#include <set>

#include "vggtcd/core/timer.h"
#include "vggtcd/core/version.h"
#include "vggtcd/io/json_file.h"
#include "vggtcd/io/output_directory.h"
#include "vggtcd/io/output_file.h"
#include "vggtcd/io/predictions.h"

namespace vggtcd {
namespace {

namespace fs = std::filesystem;

void require_two(const std::vector<PhotoRef>& photos, const std::string& source) {
  if (photos.size() >= 2) return;
  throw_error(ErrorCode::kInput,
              "{}: expected at least 2 different photos of the place, better 10 or more, found {}",
              source, photos.size());
}

std::string stage_key(const PhotoEpochs& photos, const Reconstructor& reconstructor) {
  std::string all = fmt::format("{} {}\n", kVersion, reconstructor.fingerprint());
  for (const auto* epoch : {&photos.before, &photos.after}) {
    for (const PhotoRef& photo : *epoch) {
      all += fmt::format("{} {:016x}\n", photo.name, content_hash(photo));
    }
    all += "--\n";
  }
  uint64_t hash = 0xcbf29ce484222325u;  // FNV-1a
  for (const char c : all) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  return fmt::format("{}-{:016x}", reconstructor.name(), hash);
}

// OUT holds nothing but what we may replace, so that .stages may live in it from now on.
void claim(const fs::path& out) {
  { const OutputDirectory check(out); }
  fs::create_directories(out);
  write_text_file(out / OutputDirectory::kMarker,
                  "Written by vggt-cd, which may replace this directory.\n");
}

}  // namespace

PhotoEpochs find_photo_epochs(const PhotoInputs& inputs, ProgressSink& progress) {
  for (const std::string& source : {inputs.before, inputs.after}) {
    if (names_photos(source)) continue;
    throw_error(ErrorCode::kInput,
                "{}: expected photos as on the other side, found a prediction file; give photos on "
                "both sides, or prediction files on both with --joint, --initial-sim3 or --aligned",
                source);
  }
  PhotoSourceOptions options;
  options.max_frames = inputs.frames;
  PhotoEpochs photos;
  photos.before = find_photos(inputs.before, options, progress);
  photos.after = find_photos(inputs.after, options, progress);
  require_two(photos.before, inputs.before);
  require_two(photos.after, inputs.after);
  std::set<uint64_t> before;
  for (const PhotoRef& photo : photos.before) before.insert(content_hash(photo));
  const auto repeated = static_cast<size_t>(
      std::count_if(photos.after.begin(), photos.after.end(),
                    [&](const PhotoRef& photo) { return before.count(content_hash(photo)) > 0; }));
  if (repeated == photos.after.size()) {
    throw_error(ErrorCode::kInput,
                "{} and {} hold the same {} photos; expected photos of two times", inputs.before,
                inputs.after, repeated);
  }
  if (repeated > 0) {
    progress.notice(
        fmt::format("{} photos are in both {} and {}", repeated, inputs.before, inputs.after));
  }
  return photos;
}

std::string describe_plan(const PhotoInputs& inputs, ProgressSink& progress) {
  const PhotoEpochs photos = find_photo_epochs(inputs, progress);
  const auto reconstructor = choose_reconstructor(inputs.reconstruction, progress);
  const ReconstructionPlan plan = reconstructor->plan(photos);
  return fmt::format(
      "Reconstructor: {}\nPhotos: {} before, {} after, {} in the joint reconstruction\nFrames: {} "
      "x {} "
      "px\nMemory: about {:.1f} GB ({:.1f} GB available)\nTime: about {:.0f} min on two cores\n",
      plan.note, plan.frames_before, plan.frames_after, plan.frames_joint, plan.width, plan.height,
      static_cast<double>(plan.memory_bytes) * 1e-9,
      static_cast<double>(available_memory_bytes()) * 1e-9, std::max(1.0, plan.seconds / 60));
}

ReconstructedPhotos reconstruct_photos(const PhotoInputs& inputs, const fs::path& out,
                                       ProgressSink& progress) {
  const PhotoEpochs photos = find_photo_epochs(inputs, progress);
  const auto reconstructor = choose_reconstructor(inputs.reconstruction, progress);
  claim(out);
  const fs::path stages = out / ".stages";
  const fs::path kept = stages / stage_key(photos, *reconstructor);
  if (fs::exists(kept / "reconstruction.json")) {
    progress.notice(
        fmt::format("reconstruction of an earlier run is used again ({})", kept.string()));
  } else {
    fs::create_directories(kept);
    const EpochReconstructions result = reconstructor->reconstruct(photos, kept / "work", progress);
    write_reconstruction(kept / "before.npz", result.before);
    write_reconstruction(kept / "after.npz", result.after);
    write_joint(kept / "joint.npz", result.joint);
    // Written last: the stage is complete when it is there.
    write_json_file(kept / "reconstruction.json", Json{{"reconstructor", reconstructor->name()},
                                                       {"explanation", result.explanation}});
  }
  fs::remove_all(kept / "work");
  ReconstructedPhotos done;
  done.inputs.before = kept / "before.npz";
  done.inputs.after = kept / "after.npz";
  done.inputs.joint = kept / "joint.npz";
  done.explanation = json_member(read_json_file(kept / "reconstruction.json"), "explanation",
                                 (kept / "reconstruction.json").string())
                         .get<std::string>();
  done.inputs.origin = done.explanation;
  done.inputs.has_holes = reconstructor->leaves_holes();
  return done;
}

}  // namespace vggtcd
