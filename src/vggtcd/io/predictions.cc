// SPDX-License-Identifier: Apache-2.0
// Prediction files: which program wrote this, where are its arrays, and are they what they should
// be. The conventions are in docs/formats.md, "Prediction files".
#include "vggtcd/io/predictions.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <span>

#include "vggtcd/core/error.h"
#include "vggtcd/core/tensor_view.h"
#include "vggtcd/core/timer.h"
#include "vggtcd/io/failure.h"
#include "vggtcd/io/npz.h"
#include "vggtcd/io/pose_matrix.h"
#include "vggtcd/io/prediction_layout.h"
#include "vggtcd/io/quote.h"

namespace vggtcd {
namespace {

using internal::PredictionLayout;

void expect_float(const NpzReader& npz, const std::string& key) {
  const NpyHeader& header = npz.header(key);
  if (header.kind != NpyKind::kFloat) {
    throw_error(ErrorCode::kInput, "{}: {}: expected floating-point numbers, found type {}",
                npz.name(), key, header.descr);
  }
}

// depth is [S, H, W] or [S, H, W, 1] and says what S, H and W are.
void read_frame_size(const NpzReader& npz, PredictionLayout& layout) {
  const std::vector<int64_t>& shape = npz.header("depth").shape;
  const bool three = shape.size() == 3, four = shape.size() == 4 && shape[3] == 1;
  constexpr int64_t kMaxSide = 1 << 20;
  if ((!three && !four) || shape[1] < 1 || shape[2] < 1 || shape[1] > kMaxSide ||
      shape[2] > kMaxSide || shape[0] > kMaxSide) {
    throw_error(ErrorCode::kInput, "{}: depth: expected shape [S, H, W] or [S, H, W, 1], found {}",
                npz.name(), shape_string(shape));
  }
  layout.frames = shape[0];
  layout.height = shape[1];
  layout.width = shape[2];
}

std::string images_key(const NpzReader& npz) {
  for (const char* key : {"images", "image"}) {
    if (npz.has(key)) return key;
  }
  return "";
}

// An archive may have any number of arrays, a message is one line that somebody reads.
std::string some_of(const std::vector<std::string>& keys) {
  constexpr size_t kShown = 20;
  const size_t shown = std::min(keys.size(), kShown);
  return fmt::format("{}{}", fmt::join(std::span(keys).first(shown), ", "),
                     shown < keys.size() ? fmt::format(" and {} more", keys.size() - shown) : "");
}

PredictionLayout find_layout(const NpzReader& npz) {
  PredictionLayout layout;
  if (npz.has("extrinsic")) {
    layout.poses = "extrinsic";
    layout.intrinsics = "intrinsic";
  } else if (npz.has("extrinsics")) {  // Depth Anything 3
    layout.poses = "extrinsics";
    layout.intrinsics = "intrinsics";
  } else {
    throw_error(ErrorCode::kInput,
                "{}: expected predictions with an array extrinsic (VGGT, MapAnything) or "
                "extrinsics (Depth Anything 3), found {}",
                npz.name(), some_of(npz.keys()));
  }
  for (const std::string& key : {layout.poses, layout.intrinsics, std::string("depth")}) {
    expect_float(npz, key);
  }
  read_frame_size(npz, layout);
  const std::vector<int64_t>& poses = npz.header(layout.poses).shape;
  const bool square = poses.size() == 3 && poses[1] == 4;
  npz.expect_shape(layout.poses, std::vector<int64_t>{layout.frames, square ? 4 : 3, 4});
  npz.expect_shape(layout.intrinsics, std::vector<int64_t>{layout.frames, 3, 3});
  // MapAnything saves 4 x 4 matrices under VGGT's key, and they are the inverse of VGGT's.
  layout.world_from_camera = square && layout.poses == "extrinsic";
  for (const char* key : {"depth_conf", "conf"}) {
    if (layout.confidence.empty() && npz.has(key)) layout.confidence = key;
  }
  layout.images = images_key(npz);
  for (const char* key : {"world_points_from_depth", "world_points"}) {
    if (layout.world_points.empty() && npz.has(key)) layout.world_points = key;
  }
  // MapAnything computes its world_points from depth; VGGT predicts them separately.
  layout.points_are_exact =
      layout.world_points == "world_points_from_depth" || layout.world_from_camera;
  return layout;
}

// [S, H, W] of the layout, with or without a last axis of 1.
void expect_map(const NpzReader& npz, const std::string& key, const PredictionLayout& layout) {
  std::vector<int64_t> shape{layout.frames, layout.height, layout.width};
  if (npz.header(key).shape.size() == 4) shape.push_back(1);
  npz.expect_shape(key, shape);
}

bool all_finite(std::span<const double> values) {
  return std::ranges::all_of(values, [](double value) { return std::isfinite(value); });
}

Pinhole read_pinhole(const double* k, const PredictionLayout& layout, const std::string& where) {
  const bool form = std::abs(k[1]) <= 1e-3 * std::abs(k[0]) && k[3] == 0 && k[6] == 0 &&
                    k[7] == 0 && std::abs(k[8] - 1) <= 1e-3;
  if (!form || !(k[0] > 0) || !(k[4] > 0)) {
    throw_error(ErrorCode::kInput,
                "{}: expected fx 0 cx / 0 fy cy / 0 0 1 with fx, fy > 0, found "
                "{:g} {:g} {:g} / {:g} {:g} {:g} / {:g} {:g} {:g}",
                where, k[0], k[1], k[2], k[3], k[4], k[5], k[6], k[7], k[8]);
  }
  return {k[0], k[4], k[2], k[5], static_cast<int>(layout.width), static_cast<int>(layout.height)};
}

// The name without directories. A backslash is one of Windows only in a path that begins like one
// there; in other names it is a character like any.
std::string base_name(const std::string& path) {
  std::string name = path.substr(path.find_last_of('/') + 1);
  const bool of_windows = name.starts_with('\\') || (name.size() > 2 && name.substr(1, 2) == ":\\");
  return of_windows ? name.substr(name.find_last_of('\\') + 1) : name;
}

// Results are named after photos: names that are empty, not distinct or longer than a file's name
// may be are of no use.
bool can_name_files(const std::vector<std::string>& names) {
  constexpr size_t kMaxBytes = 251;  // and four for .png
  std::set<std::string> files, stems;
  size_t longest_name = 0, longest_stem = 0;
  for (const std::string& name : names) {
    if (name.empty() || name == "." || name == "..") return false;
    const std::string file = single_line(name);
    const std::string stem = std::filesystem::path(file).stem().string();
    longest_name = std::max(longest_name, file.size());
    longest_stem = std::max(longest_stem, stem.size());
    files.insert(file);
    stems.insert(stem);
  }
  const bool by_stem = stems.size() == names.size();
  return files.size() == names.size() && (by_stem ? longest_stem : longest_name) <= kMaxBytes;
}

std::vector<std::string> read_names(const NpzReader& npz, const PredictionLayout& layout) {
  std::vector<std::string> names;
  if (npz.has("names")) {
    npz.expect_shape("names", std::vector<int64_t>{layout.frames});
    for (const std::string& path : npz.read_strings("names")) names.push_back(base_name(path));
  }
  const size_t frames = static_cast<size_t>(layout.frames);
  if (names.size() != frames || !can_name_files(names)) {
    names.clear();
    for (size_t i = 0; i < frames; ++i) names.push_back(fmt::format("frame_{:06d}", i));
  }
  return names;
}

// The views, and which frames have a pose: tracking that lost a frame leaves NaN or infinity there.
struct Views {
  std::vector<View> views;
  std::vector<bool> lost;
};

// Intrinsics of another size are sound by themselves; what gives them away is where they put the
// middle of the picture in every single frame.
void expect_intrinsics_of_frames(const std::string& where, const Views& all) {
  size_t known = 0, outside = 0, in_corner = 0;
  const Pinhole* first = nullptr;
  for (size_t i = 0; i < all.views.size(); ++i) {
    if (all.lost[i]) continue;
    const Pinhole& k = all.views[i].pinhole;
    if (first == nullptr) first = &k;
    ++known;
    outside += k.cx < -0.5 || k.cy < -0.5 || k.cx > k.width - 0.5 || k.cy > k.height - 0.5 ? 1 : 0;
    // As shares of the width and height; a frame of a few pixels may have its middle there.
    constexpr int kFewPixels = 8;
    in_corner += k.cx <= 1 && k.cy <= 1 && std::min(k.width, k.height) > kFewPixels ? 1 : 0;
  }
  if (known == 0 || (outside < known && in_corner < known)) return;
  throw_error(ErrorCode::kInput,
              "{}: expected intrinsics in pixels of the frames of {} x {}, found a principal point "
              "({:.6g}, {:.6g}) {} of the frame, and so in every frame; scale fx, cx by {} / width "
              "and fy, cy by {} / height of the picture that they are of",
              where, first->width, first->height, first->cx, first->cy,
              outside == known ? "outside" : "in the corner pixel", first->width, first->height);
}

Views read_views(const NpzReader& npz, const PredictionLayout& layout) {
  const std::vector<double> poses = npz.read<double>(layout.poses);
  const std::vector<double> intrinsics = npz.read<double>(layout.intrinsics);
  const std::vector<std::string> names = read_names(npz, layout);
  const size_t frames = static_cast<size_t>(layout.frames);
  const size_t stride = frames == 0 ? 12 : poses.size() / frames;
  Views result{std::vector<View>(frames), std::vector<bool>(frames)};
  for (size_t i = 0; i < frames; ++i) {
    View& view = result.views[i];
    view.name = names[i];
    const auto where = [&](const std::string& key) {
      return fmt::format("{}: {}: frame {}", npz.name(), key, i);
    };
    const auto pose_values = std::span(poses).subspan(i * stride, stride);
    result.lost[i] =
        !all_finite(pose_values) || !all_finite(std::span(intrinsics).subspan(i * 9, 9));
    if (result.lost[i]) {
      view.pinhole.width = static_cast<int>(layout.width);
      view.pinhole.height = static_cast<int>(layout.height);
      continue;
    }
    const Rigid3 pose = internal::pose_from_matrix(pose_values, where(layout.poses));
    view.camera_from_world = layout.world_from_camera ? pose.inverse() : pose;
    view.pinhole = read_pinhole(intrinsics.data() + i * 9, layout, where(layout.intrinsics));
  }
  expect_intrinsics_of_frames(npz.name() + ": " + layout.intrinsics, result);
  return result;
}

void read_confidence(const NpzReader& npz, const PredictionLayout& layout, Reconstruction& result,
                     ProgressSink& progress) {
  result.confidence.resize(result.num_pixels());
  if (layout.confidence.empty()) {
    std::fill(result.confidence.begin(), result.confidence.end(), 1.0f);
    progress.notice(npz.name() + ": no confidence (depth_conf or conf); all pixels count the same");
    return;
  }
  expect_float(npz, layout.confidence);
  expect_map(npz, layout.confidence, layout);
  npz.read_into<float>(layout.confidence, result.confidence);
}

// MapAnything's final_mask: pixels that are false have no depth.
void apply_mask(const NpzReader& npz, const PredictionLayout& layout, Reconstruction& result) {
  if (!npz.has("final_mask")) return;
  expect_map(npz, "final_mask", layout);
  npz.read_slabs<uint8_t>("final_mask", [&](int64_t first, std::span<const uint8_t> mask) {
    for (size_t i = 0; i < mask.size(); ++i) {
      if (mask[i] == 0) result.depth[static_cast<size_t>(first) + i] = 0;
    }
  });
}

// Finite, and so is the mean of two of them.
constexpr float kLargestConfidence = 1e30f;

// After this, depth is >= 0 and finite, and confidence can be ranked.
void drop_invalid_pixels(const std::string& name, const std::vector<bool>& lost,
                         Reconstruction& result, ProgressSink& progress) {
  size_t bad_pixels = 0, bad_depth = 0, bad_confidence = 0;
  std::vector<std::string> empty_frames;
  for (int frame = 0; frame < result.num_frames(); ++frame) {
    if (lost[static_cast<size_t>(frame)]) continue;  // leaves as a whole
    const size_t begin = static_cast<size_t>(frame) * result.pixels_per_frame();
    bool any = false;
    for (size_t i = begin; i < begin + result.pixels_per_frame(); ++i) {
      float& depth = result.depth[i];
      float& confidence = result.confidence[i];
      // Half precision saves the best confidences as infinity; they stay the best.
      if (confidence > kLargestConfidence) confidence = kLargestConfidence;
      const bool good_depth = depth >= 0 && std::isfinite(depth);
      const bool good_confidence = confidence >= -kLargestConfidence;
      bad_pixels += good_depth && good_confidence ? 0 : 1;
      bad_depth += good_depth ? 0 : 1;
      bad_confidence += good_confidence ? 0 : 1;
      if (!good_depth || !good_confidence) depth = 0;
      if (!good_confidence) confidence = 0;
      any |= depth > 0;
    }
    if (!any) empty_frames.push_back(result.views[static_cast<size_t>(frame)].name);
  }
  const auto placed = static_cast<size_t>(std::ranges::count(lost, false));
  if (empty_frames.size() == placed) {
    const bool confidence = bad_confidence > bad_depth;
    throw_error(ErrorCode::kInput, "{}: {}: expected {} numbers, found none in any of {} frames",
                name, confidence ? "confidence" : "depth", confidence ? "finite" : "positive",
                placed);
  }
  if (bad_depth + bad_confidence > 0) {
    progress.notice(fmt::format(
        "{}: {} of {} pixels are ignored: depth is NaN, infinite or negative in {}, confidence is "
        "NaN in {}",
        name, bad_pixels, result.num_pixels(), bad_depth, bad_confidence));
  }
  if (!empty_frames.empty()) {
    progress.notice(fmt::format("{}: frames without any valid depth are skipped: {}", name,
                                fmt::join(empty_frames, ", ")));
  }
}

// Stores a run of images, [S, H, W, 3] or in planes [S, 3, H, W], as level(value).
template <typename T, typename Level>
void put_colors(int64_t first, std::span<const T> values, bool planes, Reconstruction& result,
                const Level& level) {
  const size_t begin = static_cast<size_t>(first);
  if (!planes) {
    std::transform(values.begin(), values.end(), result.color.begin() + first, level);
    return;
  }
  const size_t per_frame = result.pixels_per_frame();
  for (size_t i = 0; i < values.size();) {  // plane by plane
    const size_t plane = (begin + i) / per_frame, pixel = (begin + i) % per_frame;
    const size_t count = std::min(values.size() - i, per_frame - pixel);
    uint8_t* color = result.color.data() + ((plane / 3) * per_frame + pixel) * 3 + plane % 3;
    for (size_t k = 0; k < count; ++k) color[3 * k] = level(values[i + k]);
    i += count;
  }
}

// images is [S, 3, H, W] or [S, H, W, 3], u8 or a float in [0, 1].
void read_colors(const NpzReader& npz, const PredictionLayout& layout, Reconstruction& result,
                 ProgressSink& progress) {
  constexpr uint8_t kGray = 128;
  result.color.assign(3 * result.num_pixels(), kGray);
  if (layout.images.empty()) {
    progress.notice(npz.name() + ": no images; colours are grey");
    return;
  }
  const NpyHeader& header = npz.header(layout.images);
  const bool planes =
      header.shape == std::vector<int64_t>{layout.frames, 3, layout.height, layout.width};
  if (!planes) {
    npz.expect_shape(layout.images,
                     std::vector<int64_t>{layout.frames, layout.height, layout.width, 3});
  }
  if (header.kind == NpyKind::kUnsigned) {
    npz.read_slabs<uint8_t>(layout.images, [&](int64_t first, std::span<const uint8_t> values) {
      put_colors(first, values, planes, result, [](uint8_t level) { return level; });
    });
    return;
  }
  expect_float(npz, layout.images);
  npz.read_slabs<float>(layout.images, [&](int64_t first, std::span<const float> values) {
    const auto bad = std::find_if(values.begin(), values.end(),
                                  [](float v) { return !(v >= -1e-3f && v <= 1.001f); });
    if (bad != values.end()) {
      throw_error(ErrorCode::kInput, "{}: {}: expected values in [0, 1], found {:g}", npz.name(),
                  layout.images, *bad);
    }
    // To the nearest level; bicubic resizing may have left the range by a trace.
    put_colors(first, values, planes, result, [](float value) {
      return static_cast<uint8_t>(std::clamp(value, 0.0f, 1.0f) * 255.0f + 0.5f);
    });
  });
}

void check_limits(const NpzReader& npz, const PredictionLayout& layout, int min_frames) {
  if (layout.frames < min_frames) {
    throw_error(ErrorCode::kDegenerate, "{}: expected at least {} frames, found {}", npz.name(),
                min_frames, layout.frames);
  }
  // frames, height and width are at most 2^20 each: no overflow.
  const int64_t pixels = layout.frames * layout.height * layout.width;
  if (pixels > std::numeric_limits<uint32_t>::max()) {
    throw_error(ErrorCode::kInput, "{}: expected fewer than 2^32 pixels, found {}", npz.name(),
                pixels);
  }
  const int64_t needed = pixels * 11;  // depth, confidence, colour
  const int64_t available = available_memory_bytes();
  if (needed > available) {
    throw_error(ErrorCode::kMemory, "{}: needs {} MB of memory, {} MB are free; use fewer frames",
                npz.name(), needed >> 20, available >> 20);
  }
}

void drop_lost_frames(const std::string& name, const std::vector<bool>& lost, int min_frames,
                      Reconstruction& result, ProgressSink& progress) {
  std::vector<std::string> names;
  for (size_t frame = 0; frame < lost.size(); ++frame) {
    if (lost[frame]) names.push_back(result.views[frame].name);
  }
  if (names.empty()) return;
  const size_t left = lost.size() - names.size();
  if (left < static_cast<size_t>(min_frames)) {
    throw_error(ErrorCode::kDegenerate,
                "{}: expected at least {} frames with finite poses and intrinsics, found {} of {}",
                name, min_frames, left, lost.size());
  }
  remove_frames(result, lost);
  progress.notice(
      fmt::format("{}: frames whose pose or intrinsics are not finite numbers are left out: {}",
                  name, fmt::join(names, ", ")));
}

Reconstruction read_arrays(const NpzReader& npz, ProgressSink& progress, int min_frames) {
  const PredictionLayout layout = find_layout(npz);
  check_limits(npz, layout, min_frames);
  Reconstruction result;
  result.height = static_cast<int>(layout.height);
  result.width = static_cast<int>(layout.width);
  Views all = read_views(npz, layout);
  result.views = std::move(all.views);
  result.depth.resize(result.num_pixels());
  npz.read_into<float>("depth", result.depth);
  for (size_t frame = 0; frame < all.lost.size(); ++frame) {
    if (!all.lost[frame]) continue;
    const auto begin =
        result.depth.begin() + static_cast<std::ptrdiff_t>(frame * result.pixels_per_frame());
    std::fill_n(begin, result.pixels_per_frame(), 0.0f);
  }
  read_confidence(npz, layout, result, progress);
  apply_mask(npz, layout, result);
  const bool any_placed = std::ranges::count(all.lost, false) > 0;
  if (any_placed) {
    drop_invalid_pixels(npz.name(), all.lost, result, progress);
  }
  internal::drop_strays(npz.name(), result, progress);
  internal::verify_poses(npz, layout, result, progress);
  read_colors(npz, layout, result, progress);
  if (any_placed) internal::move_near(npz, layout, result, progress);
  drop_lost_frames(npz.name(), all.lost, min_frames, result, progress);
  check_consistent(result);
  return result;
}

// The numbers of the keyframes in the epoch's file.
std::vector<int> read_keyframes(const NpzReader& npz, const std::string& key,
                                const Reconstruction& epoch) {
  npz.expect_shape(key, std::vector<int64_t>{-1});
  std::vector<int> keyframes;
  for (const int64_t frame : npz.read<int64_t>(key)) {
    if (frame < 0 || frame >= epoch.frames_in_file()) {
      throw_error(ErrorCode::kInput, "{}: {}: expected frame numbers from 0 to {}, found {}",
                  npz.name(), key, epoch.frames_in_file() - 1, frame);
    }
    keyframes.push_back(static_cast<int>(frame));
  }
  if (std::set(keyframes.begin(), keyframes.end()).size() != keyframes.size()) {
    throw_error(ErrorCode::kInput, "{}: {}: expected distinct frame numbers, found {}", npz.name(),
                key, fmt::join(keyframes, ", "));
  }
  return keyframes;
}

void expect_both_epochs(const std::string& name, const JointReconstruction& joint) {
  if (!joint.keyframes_t1.empty() && !joint.keyframes_t2.empty()) return;
  throw_error(ErrorCode::kDegenerate, "{}: expected keyframes of both epochs, found {} and {}",
              name, joint.keyframes_t1.size(), joint.keyframes_t2.size());
}

// From numbers in the files to frames of the epochs. A keyframe that either the joint pass or its
// epoch has left out leaves both.
void match_keyframes(const std::string& name, const Reconstruction& before,
                     const Reconstruction& after, JointReconstruction& joint) {
  std::vector<bool> unmatched;
  int number = 0;  // of the joint pass's frame in its file
  const auto match = [&](const Reconstruction& epoch, std::vector<int>& keyframes) {
    std::vector<int> frames;
    for (const int keyframe : keyframes) {
      if (!joint.reconstruction.frame_of_number(number++)) continue;
      const std::optional<int> frame = epoch.frame_of_number(keyframe);
      unmatched.push_back(!frame);
      if (frame) frames.push_back(*frame);
    }
    keyframes = frames;
  };
  match(before, joint.keyframes_t1);
  match(after, joint.keyframes_t2);
  joint.reconstruction.left_out.clear();  // the numbers have served
  if (std::ranges::count(unmatched, true) > 0) remove_frames(joint.reconstruction, unmatched);
  expect_both_epochs(name, joint);
}

}  // namespace

Reconstruction read_reconstruction(const std::filesystem::path& path, ProgressSink& progress,
                                   const PredictionLimits& limits) try {
  return read_arrays(NpzReader(path), progress, limits.min_frames);
} catch (...) {
  rethrow_naming(path);
}

bool prediction_has_images(const std::filesystem::path& path) {
  return !images_key(NpzReader(path)).empty();
}

PredictionSize prediction_size(const std::filesystem::path& path) {
  const NpzReader npz(path);
  const PredictionLayout layout = find_layout(npz);
  check_limits(npz, layout, PredictionLimits().min_frames);
  return {static_cast<int>(layout.frames), static_cast<int>(layout.width),
          static_cast<int>(layout.height)};
}

JointReconstruction read_joint(const std::filesystem::path& path, const Reconstruction& before,
                               const Reconstruction& after, ProgressSink& progress) try {
  const NpzReader npz(path);
  JointReconstruction joint;
  joint.keyframes_t1 = read_keyframes(npz, "keyframes_t1", before);
  joint.keyframes_t2 = read_keyframes(npz, "keyframes_t2", after);
  expect_both_epochs(npz.name(), joint);
  joint.reconstruction = read_arrays(npz, progress, 2);
  const Reconstruction& result = joint.reconstruction;
  const size_t frames = static_cast<size_t>(result.frames_in_file());
  if (joint.keyframes_t1.size() + joint.keyframes_t2.size() != frames) {
    throw_error(ErrorCode::kInput, "{}: expected one frame per keyframe ({} + {}), found {} frames",
                npz.name(), joint.keyframes_t1.size(), joint.keyframes_t2.size(), frames);
  }
  for (const Reconstruction* epoch : {&before, &after}) {
    if (epoch->width != result.width || epoch->height != result.height) {
      throw_error(ErrorCode::kInput,
                  "{}: expected frames of {} x {} as in the {} epoch, found {} x {}", npz.name(),
                  epoch->width, epoch->height, epoch == &before ? "before" : "after", result.width,
                  result.height);
    }
  }
  match_keyframes(npz.name(), before, after, joint);
  return joint;
} catch (...) {
  rethrow_naming(path);
}

}  // namespace vggtcd
