// SPDX-License-Identifier: Apache-2.0
// The classical reconstruction, stage by stage: load, cameras, frames, depth, trust.
#include "vggtcd/reconstruction/classical_reconstructor.h"

#include <algorithm>
#include <cmath>

#include "vggtcd/core/parallel.h"
#include "vggtcd/reconstruction/undistort.h"

namespace vggtcd {
namespace {

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

// Loads, reducing each at once: a hundred photos of a telephone would not fit otherwise.
SfmPhotos load(const PhotoEpochs& photos, int max_side_px, ProgressSink& progress) {
  ProgressStage stage(progress, "read photos");
  SfmPhotos loaded;
  loaded.num_before = static_cast<int>(photos.before.size());
  std::vector<const PhotoRef*> all;
  for (const PhotoRef& photo : photos.before) all.push_back(&photo);
  for (const PhotoRef& photo : photos.after) all.push_back(&photo);
  loaded.images.resize(all.size());
  const auto count = static_cast<int64_t>(all.size());
  const int64_t slab = num_threads();
  for (int64_t first = 0; first < count; first += slab) {
    parallel_for(std::min(slab, count - first), 1, [&](int64_t from, int64_t to) {
      for (auto i = static_cast<size_t>(first + from); i < static_cast<size_t>(first + to); ++i) {
        loaded.images[i] = reduced_photo(load_photo(*all[i], photos.read), max_side_px);
      }
    });
    stage.advance(static_cast<double>(first + slab) / static_cast<double>(count));
  }
  const Image& model = loaded.images.front();
  for (size_t i = 0; i < all.size(); ++i) {
    const Image& image = loaded.images[i];
    if ((image.width >= image.height) != (model.width >= model.height)) {
      throw_error(
          ErrorCode::kInput,
          "{} is {} and {} is {}; expected photos of one orientation: turn or leave out the "
          "others",
          all[i]->name, image.width >= image.height ? "landscape" : "portrait", all[0]->name,
          model.width >= model.height ? "landscape" : "portrait");
    }
  }
  return loaded;
}

struct Frames {
  std::vector<GrayView> views;
  std::vector<Image> colors;
};

Frames make_frames(const SfmResult& sfm, int side, ProgressSink& progress) {
  ProgressStage stage(progress, "undistort");
  const Image& model = sfm.reduced.front();
  const FrameSize size = frame_size(model.width, model.height, side);
  Frames frames;
  frames.views.resize(sfm.model.views.size());
  frames.colors.resize(sfm.model.views.size());
  parallel_for(static_cast<int64_t>(frames.views.size()), 1, [&](int64_t begin, int64_t end) {
    for (auto i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
      const SfmView& view = sfm.model.views[i];
      const Pinhole pinhole = covering_pinhole(view.camera, size.width, size.height);
      UndistortedPhoto photo =
          undistort(sfm.reduced[static_cast<size_t>(sfm.photo_of_view[i])], view.camera, pinhole);
      frames.views[i] = {pinhole, view.camera_from_world, brightness(photo.color),
                         std::move(photo.valid)};
      frames.colors[i] = std::move(photo.color);
    }
  });
  return frames;
}

// The frames of one epoch, in the order of its photos.
Reconstruction epoch_of(const SfmResult& sfm, const Frames& frames,
                        const std::vector<DepthMap>& depth, const std::vector<PhotoRef>& photos,
                        int first_photo) {
  Reconstruction epoch;
  epoch.width = frames.views.front().pinhole.width;
  epoch.height = frames.views.front().pinhole.height;
  for (size_t p = 0; p < photos.size(); ++p) {
    const auto at = std::find(sfm.photo_of_view.begin(), sfm.photo_of_view.end(),
                              first_photo + static_cast<int>(p));
    if (at == sfm.photo_of_view.end()) continue;
    const auto i = static_cast<size_t>(at - sfm.photo_of_view.begin());
    epoch.views.push_back(
        {frames.views[i].camera_from_world, frames.views[i].pinhole, photos[p].name});
    epoch.depth.insert(epoch.depth.end(), depth[i].depth.begin(), depth[i].depth.end());
    epoch.confidence.insert(epoch.confidence.end(), depth[i].confidence.begin(),
                            depth[i].confidence.end());
    epoch.color.insert(epoch.color.end(), frames.colors[i].rgb.begin(), frames.colors[i].rgb.end());
  }
  check_consistent(epoch);
  return epoch;
}

double share_with_depth(const Reconstruction& epoch) {
  const auto known =
      std::count_if(epoch.depth.begin(), epoch.depth.end(), [](float d) { return d > 0; });
  return static_cast<double>(known) / static_cast<double>(std::max<size_t>(1, epoch.num_pixels()));
}

void require_depth(double share, const char* epoch, const TrustOptions& options) {
  if (share >= options.min_consistent_share) return;
  throw_error(
      ErrorCode::kDegenerate,
      "classical reconstruction refused: photos agree on the depth of {:.0f} % of the pixels of "
      "the {} epoch, at least {:.0f} % is needed; take more photos from closer together, of "
      "textured surfaces, or use network weights (--weights)",
      100 * share, epoch, 100 * options.min_consistent_share);
}

void note_unplaced(const SfmResult& sfm, const std::vector<PhotoRef>& photos, int first_photo,
                   const char* epoch, ProgressSink& progress) {
  std::string names;
  for (size_t p = 0; p < photos.size(); ++p) {
    const int photo = first_photo + static_cast<int>(p);
    if (std::count(sfm.photo_of_view.begin(), sfm.photo_of_view.end(), photo) > 0) continue;
    names += (names.empty() ? "" : ", ") + photos[p].name;
  }
  if (!names.empty()) {
    progress.notice(
        fmt::format("{} photos that could not be placed are left out: {}", epoch, names));
  }
}

}  // namespace

std::string ClassicalReconstructor::fingerprint() const {
  return fmt::format(
      "classical 1; keyframes {}; side {}; features {}; planes {}; best {}; sources {}",
      options_.keyframes, options_.frame_side_px, options_.sfm.max_features,
      options_.depth.sweep.num_planes, options_.depth.sweep.best_views, options_.views.max_sources);
}

ReconstructionPlan ClassicalReconstructor::plan(const PhotoEpochs& photos) const {
  ReconstructionPlan plan;
  plan.frames_before = static_cast<int>(photos.before.size());
  plan.frames_after = static_cast<int>(photos.after.size());
  plan.frames_joint = std::min(options_.keyframes, plan.frames_before) +
                      std::min(options_.keyframes, plan.frames_after);
  const Image first = load_photo(photos.before.front(), photos.read);
  const FrameSize size = frame_size(first.width, first.height, options_.frame_side_px);
  plan.width = size.width;
  plan.height = size.height;
  const double frames = plan.frames_before + plan.frames_after;
  const double pixels = static_cast<double>(size.width) * size.height;
  // Cost volume and its sums per thread; maps, colours and the reduced photos per frame.
  const double volume = pixels * options_.depth.sweep.num_planes * 3.2;
  plan.memory_bytes =
      static_cast<int64_t>(volume * num_threads() + frames * (pixels * 40 + 4e6) + 3e8);
  // Seconds on two cores: per photo, per pair of photos, per frame.
  plan.seconds = 1.0 * frames + 0.03 * frames * frames / 2 + 1.5 * frames;
  plan.note = "classical: COLMAP over both epochs, plane-sweep depth from photos of the same epoch";
  return plan;
}

EpochReconstructions ClassicalReconstructor::reconstruct(const PhotoEpochs& photos,
                                                         const std::filesystem::path& scratch,
                                                         ProgressSink& progress) const {
  const int photos_t1 = static_cast<int>(photos.before.size());
  const int photos_t2 = static_cast<int>(photos.after.size());
  const SfmResult sfm = structure_from_motion(load(photos, options_.sfm.max_side_px, progress),
                                              options_.sfm, scratch, progress);
  const SfmTrust trust = measure_trust(sfm, photos_t1, photos_t2);
  require_trust(trust, options_.trust);
  note_unplaced(sfm, photos.before, 0, "before", progress);
  note_unplaced(sfm, photos.after, photos_t1, "after", progress);

  const Frames frames = make_frames(sfm, options_.frame_side_px, progress);
  std::vector<int> epoch_of_view;
  for (const int photo : sfm.photo_of_view) epoch_of_view.push_back(photo < photos_t1 ? 1 : 2);
  const auto tasks = plan_depth(sfm.model, epoch_of_view, options_.views);
  const auto depth = dense_depth(frames.views, tasks, options_.depth, progress);

  EpochReconstructions result;
  result.before = epoch_of(sfm, frames, depth, photos.before, 0);
  result.after = epoch_of(sfm, frames, depth, photos.after, photos_t1);
  const double known_t1 = share_with_depth(result.before),
               known_t2 = share_with_depth(result.after);
  require_depth(known_t1, "before", options_.trust);
  require_depth(known_t2, "after", options_.trust);
  result.joint = joint_of_keyframes(result.before, result.after, options_.keyframes);
  result.explanation = fmt::format(
      "Classical reconstruction (no network): {} of {} and {} of {} photos placed, depth known for "
      "{:.0f} % and {:.0f} % of the pixels.",
      trust.placed_t1, photos_t1, trust.placed_t2, photos_t2, 100 * known_t1, 100 * known_t2);
  return result;
}

}  // namespace vggtcd
