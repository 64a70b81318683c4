// SPDX-License-Identifier: Apache-2.0
// The photos and score maps of an epoch as the page carries them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "vggtcd/report/levels.h"
#include "vggtcd/report/report_input.h"

namespace vggtcd {

struct EncodedPhoto {
  int width = 0, height = 0;            // of the JPEG, or of the score map if there is no photo
  std::string jpeg;                     // empty: no photo
  int heat_width = 0, heat_height = 0;  // 0: no score map
  std::string heat_level;               // zlib stream of LevelScale::level, rows from the top
  std::string heat_label;               // likewise; empty if there are no labels
  int64_t pixels = 0;                   // with evidence, of the whole score map
  int64_t changed = 0;                  // of them, by label if there are labels, else by score
  size_t bytes() const { return jpeg.size() + heat_level.size() + heat_label.size(); }
};

// Scaled by `scale` (<= 1) in both directions: photos by area average, maps by nearest pixel.
struct PhotoQuality {
  double photo_scale = 1;
  double heat_scale = 1;
  int jpeg_quality = 85;  // 0..100
};

std::vector<EncodedPhoto> encode_photos(const ReportEpoch& epoch, const LevelScale& scale,
                                        const PhotoQuality& quality);

}  // namespace vggtcd
