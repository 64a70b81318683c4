// SPDX-License-Identifier: Apache-2.0
// preprocess: target sizes as the reference rounds them, resizing, white borders.
#include "vggtcd/vggt/preprocess.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "vggtcd/core/error.h"
#include "vggtcd/core/interrupt.h"
#include "vggtcd/vggt/image_resize.h"

namespace vggtcd {
namespace {

constexpr int kPatch = 14;
constexpr uint8_t kWhite = 255;

// 14 round(side * (target / other) / 14), as Python computes it: in this order, ties to even (the
// default rounding mode of nearbyint).
int scaled_side(int side, int other, int target) {
  const double patches = side * (static_cast<double>(target) / other) / kPatch;
  return static_cast<int>(std::nearbyint(patches)) * kPatch;
}

Image centered_on_white(const Image& image, int width, int height) {
  if (image.width == width && image.height == height) return image;
  Image result(width, height);
  std::ranges::fill(result.rgb, kWhite);
  const int left = (width - image.width) / 2, top = (height - image.height) / 2;
  for (int y = 0; y < image.height; ++y) {
    std::copy_n(image.pixel(0, y), 3 * static_cast<size_t>(image.width),
                result.pixel(left, top + y));
  }
  return result;
}

}  // namespace

std::span<const EnumName<FitMode>> enum_names(FitMode) {
  static constexpr std::array<EnumName<FitMode>, 2> kNames = {
      {{FitMode::kCrop, "crop"}, {FitMode::kPad, "pad"}}};
  return kNames;
}

Image fit_photo(const Image& photo, FitMode mode, const std::string& name, int side) {
  check(side > 0 && side % kPatch == 0, "fit_photo: a side of whole patches");
  int width = side, height = side;
  if (mode == FitMode::kCrop || photo.width >= photo.height) {
    height = scaled_side(photo.height, photo.width, side);
  } else {
    width = scaled_side(photo.width, photo.height, side);
  }
  if (width == 0 || height == 0) {
    throw_error(ErrorCode::kInput,
                "{}: {} x {} px is too narrow: at a side of {} px the other would be below {}; cut "
                "it to the part that matters",
                name, photo.width, photo.height, side, kPatch / 2);
  }
  const int first_row = height > side ? (height - side) / 2 : 0;
  const Image fitted = resize_bicubic(photo, width, height, first_row, std::min(height, side));
  return mode == FitMode::kPad ? centered_on_white(fitted, side, side) : fitted;
}

ImageBatch make_batch(std::span<const Image> photos, std::vector<std::string> names,
                      ProgressSink& progress) {
  check(!photos.empty() && names.size() == photos.size(), "make_batch: a name for each photo");
  int width = 0, height = 0;
  for (const Image& photo : photos) {
    width = std::max(width, photo.width);
    height = std::max(height, photo.height);
  }
  const auto differs = [&](const Image& photo) {
    return photo.width != width || photo.height != height;
  };
  const auto smaller = std::ranges::count_if(photos, differs);
  if (smaller > 0) {
    progress.notice(
        fmt::format("{} of {} photos have another shape and get white borders to {} x {}", smaller,
                    photos.size(), width, height));
  }
  ImageBatch batch;
  batch.frames = std::ssize(photos);
  batch.height = height;
  batch.width = width;
  batch.names = std::move(names);
  const size_t plane = static_cast<size_t>(width) * static_cast<size_t>(height);
  batch.pixels.resize(photos.size() * 3 * plane);
  float* out = batch.pixels.data();
  for (const Image& photo : photos) {
    const Image full = centered_on_white(photo, width, height);
    for (size_t c = 0; c < 3; ++c) {
      for (size_t i = 0; i < plane; ++i) *out++ = static_cast<float>(full.rgb[3 * i + c]) / 255.0f;
    }
  }
  return batch;
}

ImageBatch load_photos(std::span<const PhotoRef> photos, const PreprocessOptions& options,
                       ProgressSink& progress) {
  if (photos.empty()) throw_error(ErrorCode::kUsage, "expected at least one photo, found none");
  ProgressStage stage(progress, "photos");
  std::vector<Image> fitted;
  std::vector<std::string> names;
  PhotoRemarks remarks;
  for (const PhotoRef& photo : photos) {
    throw_if_interrupted();
    PhotoFacts facts;
    const Image image = load_photo(photo, {options.apply_exif_orientation}, &facts);
    remarks.add(photo.path.string(), facts);
    fitted.push_back(fit_photo(image, options.mode, photo.path.string()));
    names.push_back(photo.name);
    stage.advance(static_cast<double>(fitted.size()) / static_cast<double>(photos.size()));
  }
  remarks.report(progress);
  return make_batch(fitted, std::move(names), progress);
}

}  // namespace vggtcd
