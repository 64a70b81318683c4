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
// max_frames equal stretches. Photos with the bytes of an earlier one, a photo's second copy in
// another format and masks beside photos (photo_companions.h) are left out with a notice. Throws
// Error{kInput} naming the source if there is nothing, or what is there cannot be read.
std::vector<PhotoRef> find_photos(const std::string& source, const PhotoSourceOptions& options,
                                  ProgressSink& progress);

// Whether find_photos would take it; prediction files (.npz) are not photos.
bool names_photos(const std::string& source);

// Throws Error{kInput} also for a photo that is too small to show anything.
Image load_photo(const PhotoRef& photo, const ImageReadOptions& options = {},
                 PhotoFacts* facts = nullptr);

// Throws Error{kInput} naming a picture that is too small to show anything.
void require_photo_size(const Image& image, const std::string& name);

// Tells what reading photos has found, each remark once with the photos that it is true of.
class PhotoRemarks {
 public:
  void add(const std::string& photo, const PhotoFacts& facts);
  void report(ProgressSink& progress) const;

 private:
  std::vector<std::pair<std::string, std::vector<std::string>>> photos_of_;
};

// The most memory that reading one of them takes, bytes, from their headers.
int64_t largest_decode_bytes(const std::vector<const PhotoRef*>& photos);

// So many photos of this size may be in memory at once, decoded, at least one: all threads have one
// each where that is within 2 GB.
int photos_at_once(int64_t decode_bytes);

// FNV-1a over the file's bytes, or the frame's pixels: tells photos apart, guards against nothing.
uint64_t content_hash(const PhotoRef& photo);

// `count` of `total` positions, evenly, first and last included where count > 1; all if count >=
// total.
std::vector<int> evenly_spaced(int total, int count);

// Variance of the Laplacian of the brightness: large for a sharp picture.
double sharpness(const Image& image);

}  // namespace vggtcd
