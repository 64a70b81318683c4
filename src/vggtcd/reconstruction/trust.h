// SPDX-License-Identifier: Apache-2.0
// When a classical reconstruction may be believed. What is measured, and the bounds; each refusal
// is one sentence with the remedy.
#pragma once

#include <string>
#include <vector>

#include "vggtcd/core/options.h"
#include "vggtcd/reconstruction/structure_from_motion.h"

namespace vggtcd {

struct TrustOptions {
  int min_photos = 4;                 // placed, in each epoch
  double min_placed_share = 0.6;      // of an epoch's photos
  int min_shared_points = 50;         // seen from both epochs
  double min_angle_deg = 2.0;         // median over points of the widest angle between their rays
  double max_homography_share = 0.9;  // median over pairs: matches that one plane explains
  double min_consistent_share = 0.1;  // of an epoch's pixels, with depth that photos agree on
  double min_frame_share = 0.02;      // of a photo's pixels; a photo below it is left out
};

struct SfmTrust {
  int photos_t1 = 0, photos_t2 = 0;
  int placed_t1 = 0, placed_t2 = 0;
  int shared_points = 0;
  double median_angle_deg = 0;
  double homography_share = 0;  // over pairs of placed photos
};

SfmTrust measure_trust(const SfmResult& sfm, int photos_t1, int photos_t2);

// Throws Error{kDegenerate} if an epoch has too few photos even if all of them are placed.
void require_photos(int photos_t1, int photos_t2, const TrustOptions& options);

// Throws Error{kDegenerate} naming the first bound that is not met.
void require_trust(const SfmTrust& trust, const TrustOptions& options);

// Throws Error{kDegenerate} if photos agree on the depth of too small a share of an epoch's pixels.
void require_depth(double known_share, const char* epoch, const TrustOptions& options);

}  // namespace vggtcd
