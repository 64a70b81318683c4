// SPDX-License-Identifier: Apache-2.0
// What a photo of the other epoch says about a point: its depths with the window around each pixel,
// the projection into it, and the one rule that makes a vote of both.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "vggtcd/change/depth_windows.h"
#include "vggtcd/change/pair_alignment.h"
#include "vggtcd/core/options.h"
#include "vggtcd/geometry/sim3.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

// An epoch with everything that a point of the other one is held against, in the common frame T2.
struct Witness {
  const Reconstruction* epoch;
  float t2_scale;  // T2 units of a unit of the epoch
  float
      open_gap_u;  // how far beyond a point a photo sees at least where it looks into the open sky
  WindowSteps steps;
  std::vector<Rigid3> camera_from_t2;  // depths in T2 units
  std::vector<uint8_t> extremes;       // [S, H, W]: of the DepthWindows
  DepthCorrection correction{};        // of the epoch's depths

  DepthWindows windows(size_t frame) const {
    const size_t first = frame * epoch->pixels_per_frame();
    return {epoch->depth.data() + first, extremes.data() + first, &steps, t2_scale, epoch->width,
            correction.photo(frame)};
  }
};

// A pixel may testify, and be judged, if it has depth and is not among the least confident.
inline bool testifies(const Reconstruction& r, size_t pixel, float min_confidence) {
  return r.depth[pixel] > 0 && r.confidence[pixel] >= min_confidence;
}

// open_gap_u: T2 units.
Witness make_witness(const Reconstruction& epoch, const Sim3& t2_from_epoch, float min_confidence,
                     double open_gap_u);

// The projection of a pair of photos as floats, for the inner loop.
struct PairProjection {
  Eigen::Matrix3f matrix;
  Eigen::Vector3f offset;
  float sigma = 0;  // relative, of the gaps of the pair; 0: gives no testimony
  int width, height;

  PairProjection(const PairAlignment& pair, const Pinhole& pinhole, double sigma_of_pair)
      : matrix((pinhole.matrix() * pair.matrix).cast<float>()),
        offset((pinhole.matrix() * pair.offset).cast<float>()),
        sigma(static_cast<float>(sigma_of_pair)),
        width(pinhole.width),
        height(pinhole.height) {}

  // The pixel and the depth; false if the point is outside the photo.
  bool operator()(const Eigen::Vector3f& x, int& column, int& row, float& depth) const {
    const Eigen::Vector3f h = matrix * x + offset;
    depth = h.z();
    if (!(depth > 0)) return false;
    const float u = h.x() / depth + 0.5f, v = h.y() / depth + 0.5f;
    if (!(u >= 0 && v >= 0 && u < static_cast<float>(width) && v < static_cast<float>(height)))
      return false;
    column = static_cast<int>(u);
    row = static_cast<int>(v);
    return true;
  }
};

enum class Vote : uint8_t {
  kLooksThrough,  // a vote for change
  kSees,          // the point's surface: a vote against
  kHidden,        // behind something: no vote
  kOutside,       // of the photo: no vote
  kNoTestimony    // no depth that may testify there, or the pair disagrees too much: no vote
};
std::span<const EnumName<Vote>> enum_names(Vote);

// One photo about one point. T2 units.
struct Testimony {
  Vote vote = Vote::kOutside;
  int column = 0, row = 0;  // of the photo, where the point falls
  float z = 0;              // depth of the point there
  float near = 0, far = 0;  // of the 3 x 3 window; far 0: nothing there may testify
  float gap_u = 0;          // signed: how far the photo sees beyond the point
  float sigma_u = 0;        // of the gaps of this pair at this depth
};

// A window whose depths span less than this ratio shows one surface.
inline constexpr float kOneSurface = 1.1f;

// The rule, with t = tolerance_sigmas * sigma * z: near - z > t looks through, z - far > t hidden,
// otherwise the surface is seen. A window of one surface is taken at half its width: the pixel
// nearest to a point is half a pixel off at most, the window one and a half. Where the photo shows
// the open sky it looks through any point, by open_gap_u. x is in T2.
inline Testimony ask(const PairProjection& pair, const DepthWindows& photo,
                     const Eigen::Vector3f& x, float tolerance_sigmas, float open_gap_u) {
  Testimony said;
  if (!pair(x, said.column, said.row, said.z)) return said;
  said.vote = Vote::kNoTestimony;
  said.sigma_u = pair.sigma * said.z;
  if (photo.open(said.column, said.row)) {
    if (!(said.sigma_u > 0)) return said;
    said.gap_u = open_gap_u;
    said.near = said.far = said.z + open_gap_u;
    said.vote = Vote::kLooksThrough;
    return said;
  }
  if (!photo.read(said.column, said.row, said.near, said.far)) return said;
  if (said.far < kOneSurface * said.near) {
    const float quarter = 0.25f * (said.far - said.near);
    said.near += quarter;
    said.far -= quarter;
  }
  said.gap_u =
      said.z < said.near ? said.near - said.z : (said.z > said.far ? said.far - said.z : 0.0f);
  if (!(said.sigma_u > 0)) return said;
  const float tolerance = tolerance_sigmas * said.sigma_u;
  said.vote = said.z - said.far > tolerance ? Vote::kHidden
              : said.gap_u > tolerance      ? Vote::kLooksThrough
                                            : Vote::kSees;
  return said;
}

}  // namespace vggtcd
