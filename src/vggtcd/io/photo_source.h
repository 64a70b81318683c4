// SPDX-License-Identifier: Apache-2.0
// The photos that a user names: by a folder, a glob pattern, a file, or a video.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "vggtcd/core/progress.h"
#include "vggtcd/io/image_file.h"
#include "vggtcd/scene/image.h"

namespace vggtcd {

// A photo that is read when it is needed; a frame of a video is there already.
struct PhotoRef {
  std::filesystem::path path;
  std::string name;                      // file name; of a frame "walk_000012.mp4"
  std::shared_ptr<const Image> decoded;  // frames of a video only
};

struct PhotoSourceOptions {
  int max_frames = 0;  // 0: all photos; of a video 40. More are thinned out evenly.
  ImageReadOptions read;
};

// Whether a comes before b: runs of digits compare as numbers (photo_2 before photo_10, of any
// length), the rest byte by byte.
bool natural_less(std::string_view a, std::string_view b);

// The photos named by `source`, in natural order of their names. A folder contributes the files
// with the ending of a picture, not those of folders below; others are counted in a notice. A
// pattern with * or ? stands for the matching files of one folder, a file for itself, whatever its
// ending; a video for its frames: the sharpest (largest variance of the Laplacian) of each of
// max_frames equal stretches. Photos with the bytes of an earlier one are left out with a notice.
// Throws Error{kInput} naming the source if there is nothing, or what is there cannot be read.
std::vector<PhotoRef> find_photos(const std::string& source, const PhotoSourceOptions& options,
                                  ProgressSink& progress);

// Whether find_photos would take it; prediction files (.npz) are not photos.
bool names_photos(const std::string& source);

Image load_photo(const PhotoRef& photo, const ImageReadOptions& options = {});

// FNV-1a over the file's bytes, or the frame's pixels: tells photos apart, guards against nothing.
uint64_t content_hash(const PhotoRef& photo);

// `count` of `total` positions, evenly, first and last included where count > 1; all if count >=
// total.
std::vector<int> evenly_spaced(int total, int count);

// Variance of the Laplacian of the brightness: large for a sharp picture.
double sharpness(const Image& image);

}  // namespace vggtcd
