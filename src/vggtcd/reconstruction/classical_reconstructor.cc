// SPDX-License-Identifier: Apache-2.0
// The classical reconstruction, stage by stage: load, cameras, trust, depth of each epoch, joint.
#include "vggtcd/reconstruction/classical_reconstructor.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "vggtcd/core/parallel.h"
#include "vggtcd/geometry/order_statistics.h"
#include "vggtcd/io/file_system.h"
#include "vggtcd/io/kept_files.h"
#include "vggtcd/io/predictions.h"
#include "vggtcd/reconstruction/undistort.h"

namespace vggtcd {
namespace {

namespace fs = std::filesystem;

struct FrameSize {
  int width = 0, height = 0;
};

// The longer side is `side`; the other follows the photo and is a multiple of 14, so that the size
// is one that the network could have.
FrameSize frame_size(int photo_width, int photo_height, int side) {
  constexpr int kPatch = 14;
  const double ratio = static_cast<double>(std::min(photo_width, photo_height)) /
                       static_cast<double>(std::max(photo_width, photo_height));
  const int shorter = std::max(1, static_cast<int>(std::lround(side * ratio / kPatch))) * kPatch;
  return photo_width >= photo_height ? FrameSize{side, shorter} : FrameSize{shorter, side};
}

// Seconds of one thread of a Zen 5 server, measured on the generated scenes of docs/benchmark.md.
constexpr double kReadSecondsPerPixel = 2e-8;  // decode, reduce
constexpr double kKeyPointSecondsPerPixel = 3.3e-7;
constexpr double kSecondsPerPair = 0.05;          // matching
constexpr double kSecondsPerPlaced = 0.6;         // COLMAP, which runs with one thread
constexpr double kSecondsPerPlanePixel = 7.5e-8;  // depth: a pixel of a plane

const char* orientation_of(const Image& image) {
  return image.width >= image.height ? "landscape" : "portrait";
}

// The camera of a given prediction: the median over its frames, in px of the reduced images.
std::optional<KnownCamera> known_camera(const EpochPhotos& epoch, const Image& reduced) {
  if (!epoch.given) return std::nullopt;
  const auto median = [&](double Pinhole::*field) {
    std::vector<double> values;
    for (const View& view : epoch.given->views) values.push_back(view.pinhole.*field);
    return middle_of(std::move(values));
  };
  const double scale = static_cast<double>(reduced.width) / epoch.given->width;
  return KnownCamera{scale * median(&Pinhole::fx), scale * (median(&Pinhole::cx) + 0.5) - 0.5,
                     scale * (median(&Pinhole::cy) + 0.5) - 0.5};
}

std::vector<const PhotoRef*> all_photos(const PhotoEpochs& photos) {
  std::vector<const PhotoRef*> all;
  for (const PhotoRef& photo : photos.before.photos) all.push_back(&photo);
  for (const PhotoRef& photo : photos.after.photos) all.push_back(&photo);
  return all;
}

// Loads, reducing each at once: a hundred photos of a telephone would not fit otherwise.
SfmPhotos load(const PhotoEpochs& photos, int max_side_px, ProgressSink& progress) {
  ProgressStage stage(progress, "read photos");
  SfmPhotos loaded;
  loaded.num_before = static_cast<int>(photos.before.photos.size());
  const std::vector<const PhotoRef*> all = all_photos(photos);
  loaded.images.resize(all.size());
  std::vector<PhotoFacts> facts(all.size());
  const auto count = static_cast<int64_t>(all.size());
  const int64_t slab = photos_at_once(largest_decode_bytes(all));
  for (int64_t first = 0; first < count; first += slab) {
    parallel_for(std::min(slab, count - first), 1, [&](int64_t from, int64_t to) {
      for (auto i = static_cast<size_t>(first + from); i < static_cast<size_t>(first + to); ++i) {
        loaded.images[i] = reduced_photo(load_photo(*all[i], photos.read, &facts[i]), max_side_px);
      }
    });
    stage.advance(static_cast<double>(first + slab) / static_cast<double>(count));
  }
  PhotoRemarks remarks;
  for (size_t i = 0; i < all.size(); ++i) {
    const char* epoch = i < photos.before.photos.size() ? "before" : "after";
    remarks.add(fmt::format("{}/{}", epoch, all[i]->name), facts[i]);
    loaded.exif.push_back(std::move(facts[i].exif));
  }
  remarks.report(progress);
  const std::string_view wanted = orientation_of(loaded.images.front());
  for (size_t i = 0; i < all.size(); ++i) {
    if (orientation_of(loaded.images[i]) == wanted) continue;
    throw_error(ErrorCode::kInput,
                "{}/{} is {} and before/{} is {}; expected photos of one orientation: turn or "
                "leave out the others",
                i < photos.before.photos.size() ? "before" : "after", all[i]->name,
                orientation_of(loaded.images[i]), all[0]->name, wanted);
  }
  loaded.camera_t1 = known_camera(photos.before, loaded.images.front());
  loaded.camera_t2 = known_camera(photos.after, loaded.images.back());
  return loaded;
}

// One epoch of the job, as the stages after the cameras see it.
struct EpochTask {
  const char* name;  // "before", "after"
  const std::vector<PhotoRef>& photos;
  int first_photo;         // its number among all photos
  std::vector<int> views;  // of the model, in the order of the photos
  std::vector<std::string> unplaced;

  const std::string& name_of(const SfmResult& sfm, int view) const {
    return photos[static_cast<size_t>(sfm.photo_of_view[static_cast<size_t>(view)] - first_photo)]
        .name;
  }
};

EpochTask epoch_task(const char* name, const std::vector<PhotoRef>& photos, int first_photo,
                     const SfmResult& sfm) {
  EpochTask task{name, photos, first_photo, {}, {}};
  for (size_t p = 0; p < photos.size(); ++p) {
    const auto at = std::find(sfm.photo_of_view.begin(), sfm.photo_of_view.end(),
                              first_photo + static_cast<int>(p));
    if (at == sfm.photo_of_view.end()) {
      task.unplaced.push_back(photos[p].name);
    } else {
      task.views.push_back(static_cast<int>(at - sfm.photo_of_view.begin()));
    }
  }
  return task;
}

struct Frames {
  std::vector<GrayView> views;
  std::vector<Image> colors;
};

Frames make_frames(const SfmResult& sfm, const std::vector<int>& views, const FrameSize& size) {
  Frames frames;
  frames.views.resize(views.size());
  frames.colors.resize(views.size());
  parallel_for(static_cast<int64_t>(views.size()), 1, [&](int64_t begin, int64_t end) {
    for (auto i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
      const auto v = static_cast<size_t>(views[i]);
      const SfmView& view = sfm.model.views[v];
      const Pinhole pinhole = covering_pinhole(view.camera, size.width, size.height);
      UndistortedPhoto photo =
          undistort(sfm.reduced[static_cast<size_t>(sfm.photo_of_view[v])], view.camera, pinhole);
      frames.views[i] = {pinhole, view.camera_from_world, brightness(photo.color),
                         std::move(photo.valid)};
      frames.colors[i] = std::move(photo.color);
    }
  });
  return frames;
}

// The tasks of these views, their sources numbered by position in the list.
std::vector<DepthTask> tasks_of(const std::vector<DepthTask>& tasks,
                                const std::vector<int>& views) {
  std::vector<DepthTask> result;
  for (const int view : views) {
    DepthTask task = tasks[static_cast<size_t>(view)];
    for (int& source : task.sources) {
      const auto at = std::find(views.begin(), views.end(), source);
      check(at != views.end(), "classical: the sources of a view are of its epoch");
      source = static_cast<int>(at - views.begin());
    }
    result.push_back(std::move(task));
  }
  return result;
}

double known_share(std::span<const float> depth) {
  const auto known = std::count_if(depth.begin(), depth.end(), [](float d) { return d > 0; });
  return static_cast<double>(known) / static_cast<double>(std::max<size_t>(1, depth.size()));
}

void append(const EpochTask& task, const SfmResult& sfm, const Frames& frames, size_t i,
            const DepthMap& map, Reconstruction& epoch) {
  const auto add = [](auto& target, const auto& values) {
    target.insert(target.end(), values.begin(), values.end());
  };
  epoch.views.push_back({frames.views[i].camera_from_world, frames.views[i].pinhole,
                         task.name_of(sfm, task.views[i])});
  add(epoch.depth, map.depth);
  // Agreement has decided already. The rule that the more confident half of an epoch is evidence
  // would take half of it again, and all of a photo with few neighbours.
  for (const float depth : map.depth) epoch.confidence.push_back(depth > 0 ? 1.0f : 0.0f);
  add(epoch.color, frames.colors[i].rgb);
}

// The frames of an epoch that have depth.
Reconstruction make_epoch(const EpochTask& task, const SfmResult& sfm,
                          const std::vector<DepthTask>& all_tasks, const FrameSize& size,
                          const ClassicalOptions& options, ProgressStage& stage) {
  const Frames frames = make_frames(sfm, task.views, size);
  const std::vector<DepthMap> depth =
      dense_depth(frames.views, tasks_of(all_tasks, task.views), options.depth, stage);
  Reconstruction epoch;
  epoch.width = size.width;
  epoch.height = size.height;
  double share = 0;
  for (size_t i = 0; i < depth.size(); ++i) {
    const double known = known_share(depth[i].depth);
    share += known / static_cast<double>(depth.size());
    if (known < options.trust.min_frame_share) continue;
    append(task, sfm, frames, i, depth[i], epoch);
  }
  require_depth(share, task.name, options.trust);
  if (epoch.num_frames() < 2) {
    throw_error(ErrorCode::kDegenerate,
                "classical reconstruction refused: {} of the {} photos has depth, at least 2 are "
                "needed; take more photos from closer together, or use network weights (--weights)",
                epoch.num_frames(), task.name);
  }
  check_consistent(epoch);
  return epoch;
}

void note_left_out(const std::vector<std::string>& names, const char* epoch, const char* why,
                   ProgressSink& progress) {
  if (names.empty()) return;
  progress.notice(fmt::format("{} photos {} are left out: {}", epoch, why, fmt::join(names, ", ")));
}

std::vector<std::string> without_depth(const EpochTask& task, const SfmResult& sfm,
                                       const Reconstruction& epoch) {
  std::vector<std::string> names;
  for (const int view : task.views) {
    const std::string& name = task.name_of(sfm, view);
    const bool there = std::any_of(epoch.views.begin(), epoch.views.end(),
                                   [&](const View& v) { return v.name == name; });
    if (!there) names.push_back(name);
  }
  return names;
}

// Keyframes as numbers of the given prediction's frames instead of those placed.
void renumber(const EpochPhotos& photos, const Reconstruction& placed,
              std::vector<int>& keyframes) {
  if (!photos.given) return;
  for (int& keyframe : keyframes) {
    const std::string& name = placed.views[static_cast<size_t>(keyframe)].name;
    const auto at = std::find_if(photos.photos.begin(), photos.photos.end(),
                                 [&](const PhotoRef& photo) { return photo.name == name; });
    check(at != photos.photos.end(), "classical: a placed frame is one of the given");
    keyframe = static_cast<int>(at - photos.photos.begin());
  }
}

}  // namespace

std::string ClassicalReconstructor::fingerprint() const {
  return fmt::format(
      "classical 5; keyframes {}; side {}; features {}; planes {}; best {}; sources {}",
      options_.keyframes, options_.frame_side_px, options_.sfm.max_features,
      options_.depth.sweep.num_planes, options_.depth.sweep.best_views, options_.views.max_sources);
}

ReconstructionPlan ClassicalReconstructor::plan(const PhotoEpochs& photos) const {
  require_colmap();
  ReconstructionPlan plan;
  plan.frames_before = static_cast<int>(photos.before.photos.size());
  plan.frames_after = static_cast<int>(photos.after.photos.size());
  require_photos(plan.frames_before, plan.frames_after, options_.trust);
  plan.frames_joint = std::min(options_.keyframes, plan.frames_before) +
                      std::min(options_.keyframes, plan.frames_after);
  const Image first = load_photo(photos.before.photos.front(), photos.read);
  const Reconstruction* given = photos.given();
  const FrameSize size = given ? FrameSize{given->width, given->height}
                               : frame_size(first.width, first.height, options_.frame_side_px);
  plan.width = size.width;
  plan.height = size.height;
  const double frames = plan.frames_before + plan.frames_after;
  const double pixels = static_cast<double>(size.width) * size.height;
  const double planes = options_.depth.sweep.num_planes;
  // Cost volume and its sums per thread; maps, colours and the reduced photos per frame. Before
  // that, photos are decoded.
  const double volume = pixels * planes * 3.2;
  constexpr double kReducedPhotoBytes = 4e6, kFixedBytes = 3e8;
  const int64_t photo_bytes = largest_decode_bytes(all_photos(photos));
  const double decoding = static_cast<double>(photo_bytes) * photos_at_once(photo_bytes);
  plan.memory_bytes = static_cast<int64_t>(
      std::max(volume * num_threads() + frames * (pixels * 40 + kReducedPhotoBytes),
               decoding + frames * kReducedPhotoBytes) +
      kFixedBytes);
  const double threads = num_threads();
  const double pairs = frames * (frames - 1) / 2;
  const double photo_pixels = static_cast<double>(first.width) * first.height;
  const double reduction = std::min(
      1.0, static_cast<double>(options_.sfm.max_side_px) / std::max(first.width, first.height));
  const double reduced_pixels = photo_pixels * reduction * reduction;
  const auto depth = [&](int count) {
    return kSecondsPerPlanePixel * pixels * planes * count / threads;
  };
  plan.stages = {{"read photos", kReadSecondsPerPixel * photo_pixels * frames / threads},
                 {"key points", kKeyPointSecondsPerPixel * reduced_pixels * frames / threads},
                 {"matching", kSecondsPerPair * pairs / threads},
                 {"structure from motion", kSecondsPerPlaced * frames},
                 {"before: depth", depth(plan.frames_before)},
                 {"after: depth", depth(plan.frames_after)}};
  plan.note =
      "classical: COLMAP over both epochs, plane-sweep depth from photos of the same epoch; time "
      "at rates measured on a Zen 5 server, with photos full of detail";
  return plan;
}

void ClassicalReconstructor::check_photos(const PhotoEpochs& photos, ProgressSink& progress) const {
  load(photos, options_.sfm.max_side_px, progress);
}

std::string ClassicalReconstructor::reconstruct(const PhotoEpochs& photos, const fs::path& folder,
                                                ProgressSink& progress) const {
  require_colmap();
  const int photos_t1 = static_cast<int>(photos.before.photos.size());
  const int photos_t2 = static_cast<int>(photos.after.photos.size());
  const fs::path work = folder / "work";
  const SfmResult sfm = structure_from_motion(load(photos, options_.sfm.max_side_px, progress),
                                              options_.sfm, work, progress);
  const SfmTrust trust = measure_trust(sfm, photos_t1, photos_t2);
  require_trust(trust, options_.trust);

  const Image& model = sfm.reduced.front();
  const Reconstruction* given = photos.given();
  const FrameSize size = given ? FrameSize{given->width, given->height}
                               : frame_size(model.width, model.height, options_.frame_side_px);
  std::vector<int> epoch_of_view;
  for (const int photo : sfm.photo_of_view) epoch_of_view.push_back(photo < photos_t1 ? 1 : 2);
  const std::vector<DepthTask> tasks = plan_depth(sfm.model, epoch_of_view, options_.views);
  const auto epoch = [&](const EpochTask& task, const EpochPhotos& of, const char* file) {
    const fs::path& where = of.given ? work : folder;
    if (!is_kept(where, file)) {
      ProgressStage stage(progress, std::string(task.name) + ": depth");
      write_reconstruction(where / file, make_epoch(task, sfm, tasks, size, options_, stage));
      keep(where, file);
    }
    Reconstruction result = read_reconstruction(where / file, progress);
    note_left_out(task.unplaced, task.name, "that could not be placed", progress);
    note_left_out(without_depth(task, sfm, result), task.name, "without depth", progress);
    return result;
  };
  const Reconstruction before =
      epoch(epoch_task("before", photos.before.photos, 0, sfm), photos.before, kBeforeFile);
  const Reconstruction after =
      epoch(epoch_task("after", photos.after.photos, photos_t1, sfm), photos.after, kAfterFile);
  if (!is_kept(folder, kJointFile)) {
    JointReconstruction joint = joint_of_keyframes(before, after, options_.keyframes);
    renumber(photos.before, before, joint.keyframes_t1);
    renumber(photos.after, after, joint.keyframes_t2);
    joint.keyframes_t1 = numbers_in_file(photos.before, joint.keyframes_t1);
    joint.keyframes_t2 = numbers_in_file(photos.after, joint.keyframes_t2);
    write_joint(folder / kJointFile, joint);
    keep(folder, kJointFile);
  }
  const auto made = [](int placed, const Reconstruction& result, const EpochPhotos& of) {
    return fmt::format("{} of {} {} placed, depth known for {:.0f} % of the pixels of {}", placed,
                       of.photos.size(), of.given ? "given frames" : "photos",
                       100 * known_share(result.depth), result.num_frames());
  };
  return fmt::format("Classical reconstruction (no network): before, {}; after, {}.",
                     made(trust.placed_t1, before, photos.before),
                     made(trust.placed_t2, after, photos.after));
}

}  // namespace vggtcd
