// SPDX-License-Identifier: Apache-2.0
// The sky is no surface, but a network gives it a depth: which pixels show it.
#pragma once

#include <cstddef>
#include <cstdint>

#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

// Values of Reconstruction::sky. kOpenSky: the depth that was made up lies beyond (nearly) all
// surfaces of the photo, so there is nothing on the way; kSky says only that the pixel shows no
// surface.
constexpr uint8_t kNoSky = 0, kSky = 1, kOpenSky = 2;

// Finds the sky in the photos, notes it in reconstruction.sky and takes its depth away. Returns the
// number of its pixels; sky stays empty where there are none.
//
// A network of VGGT's family gives each depth a confidence 1 + exp(x), and the sky has one near 1.
// A pixel may be sky if its confidence above 1 is at most a tenth of the 75th percentile of all and
// at most 0.2, and if it is farther away than nine tenths of the confident surface of its photo. Of
// these pixels an area counts that a square of 1/65 of the width fits into, if it holds 0.5 % of
// the photo; a single pixel within it follows its neighbours. Confidences below 1 are of another
// kind, and where all are equal they say nothing: then no sky is found.
size_t remove_sky(Reconstruction& reconstruction);

// Of all pixels, 0 to 1.
double sky_share(const Reconstruction& reconstruction);

}  // namespace vggtcd
