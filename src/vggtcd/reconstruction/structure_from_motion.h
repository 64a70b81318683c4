// SPDX-License-Identifier: Apache-2.0
// Cameras and sparse points of photos whose cameras are unknown, by COLMAP, over both epochs at
// once.
#pragma once

#include <filesystem>
#include <optional>

#include "vggtcd/core/options.h"
#include "vggtcd/core/progress.h"
#include "vggtcd/features/features.h"
#include "vggtcd/io/exif.h"
#include "vggtcd/reconstruction/colmap_model.h"

namespace vggtcd {

struct SfmOptions {
  int max_side_px = 1024;             // photos are reduced to this before key points are looked for
  int max_features = 4096;            // per photo
  int min_pair_inliers = 15;          // matches of a pair of photos on one epipolar geometry
  double init_min_tri_angle_deg = 4;  // COLMAP's 16 finds no first pair in a slow walk
  int init_min_num_inliers = 40;      // COLMAP's 100 finds none among few photos

  void validate() const;
};

// The photo with its longer side at most max_side_px.
Image reduced_photo(const Image& photo, int max_side_px);

// A camera that is known: frames of a prediction, without distortion. In px of the reduced photos,
// pixel centres at integers.
struct KnownCamera {
  double focal_px = 0, cx = 0, cy = 0;
};

// The photos of one job, reduced: both epochs, before first.
struct SfmPhotos {
  std::vector<Image> images;
  std::vector<Exif> exif;  // of each photo
  int num_before = 0;
  std::optional<KnownCamera> camera_t1, camera_t2;  // of all photos of the epoch
};

struct SfmResult {
  SfmModel model;                  // in the pixels of the reduced photos
  std::vector<int> photo_of_view;  // photo number of each view of the model
  std::vector<PhotoPair> pairs;
  std::vector<Image> reduced;  // the photos that were given
};

// Before anything is read: throws Error{kUnavailable} with the remedy if COLMAP is missing.
void require_colmap();

// Features and matches by features.h, then COLMAP's incremental mapper as a child process with one
// thread (its results depend on the number of threads). Cameras are SIMPLE_RADIAL, one for each
// epoch, photo size, and device, lens, focal length and zoom as EXIF tells them (photo_cameras.h);
// their focal lengths start at 1.2 and, where that leaves photos out, at 0.85 times the longer
// side, or, where an epoch has several lenses, where EXIF says. Known ones are SIMPLE_PINHOLE and
// start as they are. Chosen is the model with most photos; it is without views if the photos gave
// none. `scratch` keeps the two stages (io/kept_files.h), matches.npz and model/ or no_model; what
// an earlier call with the same photos and options left there is used. Throws Error{kUnavailable}
// without COLMAP, and if COLMAP was ended or failed for another reason than the photos: nothing of
// that is kept.
SfmResult structure_from_motion(SfmPhotos photos, const SfmOptions& options,
                                const std::filesystem::path& scratch, ProgressSink& progress);

}  // namespace vggtcd
