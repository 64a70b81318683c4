// SPDX-License-Identifier: Apache-2.0
// preprocess: photos of any size -> the batch that the network reads; upstream
// vggt.utils.load_fn.load_and_preprocess_images.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "vggtcd/core/options.h"
#include "vggtcd/core/progress.h"
#include "vggtcd/io/photo_source.h"
#include "vggtcd/scene/image.h"
#include "vggtcd/vggt/image_batch.h"

namespace vggtcd {

enum class FitMode {
  kCrop,  // width 518, rows beyond 518 cut off above and below
  kPad    // longer side 518, white bars to a square
};
std::span<const EnumName<FitMode>> enum_names(FitMode);

struct PreprocessOptions {
  FitMode mode = FitMode::kCrop;
  bool apply_exif_orientation = true;

  static constexpr auto fields = [](auto&& self, auto&& field) {
    field("mode", self.mode, "crop: width 518, tall photos lose rows; pad: white bars to a square");
    field("apply_exif_orientation", self.apply_exif_orientation,
          "turn photos as their EXIF data say; the reference does not");
  };
};

// The side of the frames that the network was trained with, px.
inline constexpr int kTrainedSide = 518;

// One photo fitted: sides are multiples of 14 and at most `side` px, itself a multiple of 14. Crop
// mode: width 518, height 14 round(518 h / (14 w)) (ties to even), then the middle 518 rows. Pad
// mode: the longer side 518, the other likewise, centred on a white square. Error{kInput} naming
// `name` if a side would vanish.
Image fit_photo(const Image& photo, FitMode mode, const std::string& name, int side = kTrainedSide);

// Photos of one size, as [S, 3, H, W] in [0, 1]; value k / 255. Smaller ones are centred on white;
// `progress` gets a notice when there are any. names: one per photo.
ImageBatch make_batch(std::span<const Image> photos, std::vector<std::string> names,
                      ProgressSink& progress = silent_progress());

// Reads, fits and batches. Error{kUsage} if there are none, Error{kInput}
// for the first that cannot be read.
ImageBatch load_photos(std::span<const PhotoRef> photos, const PreprocessOptions& options,
                       ProgressSink& progress);

}  // namespace vggtcd
