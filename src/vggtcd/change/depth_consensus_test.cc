// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/change/depth_consensus.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/toy_scene.h"

namespace vggtcd {
namespace {

using testing_support::kT2FromT1;
using testing_support::reconstruct;
using testing_support::ToyScene;

constexpr double kExtent = 6;  // of the toy scene, about

double waves(double x, double y) { return 0.2 * std::sin(2 * x) * std::cos(1.5 * y); }

Reconstruction walk(int frames) {
  return reconstruct({.frames = frames, .width = 120, .height = 90, .relief = waves}, Sim3{});
}

DepthCorrection consensus(const Reconstruction& r, const Sim3& t2_from_epoch = {}) {
  return depth_consensus(make_witness(r, t2_from_epoch, 0, 1), t2_from_epoch, 0,
                         kExtent * t2_from_epoch.scale, {});
}

// A bump of 0.5 % in the middle of a photo, a quarter of its width wide.
float bump(const Reconstruction& r, int u, int v) {
  const double x = (u - 0.5 * r.width) / (0.12 * r.width);
  const double y = (v - 0.5 * r.height) / (0.12 * r.width);
  return static_cast<float>(1 + 0.005 * std::exp(-0.5 * (x * x + y * y)));
}

// The largest |factor * error - 1| of a frame in the inner part of the photo.
double worst(const Reconstruction& r, const DepthCorrection& correction, int frame, bool bumped) {
  double largest = 0;
  for (int v = r.height / 5; v < 4 * r.height / 5; ++v) {
    for (int u = r.width / 5; u < 4 * r.width / 5; ++u) {
      const float factor = correction.photo(static_cast<size_t>(frame)).factor(u, v);
      const float error = bumped ? bump(r, u, v) : 1.0f;
      largest = std::max(largest, std::abs(static_cast<double>(factor * error) - 1));
    }
  }
  return largest;
}

TEST(DepthConsensus, TakesOffWhatOnePhotoAloneSays) {
  constexpr int kFrame = 2;
  Reconstruction r = walk(5);
  for (int v = 0; v < r.height; ++v) {
    for (int u = 0; u < r.width; ++u) {
      r.depth[kFrame * r.pixels_per_frame() + static_cast<size_t>(v * r.width + u)] *=
          bump(r, u, v);
    }
  }
  for (const Sim3& t2_from_epoch : {Sim3{}, kT2FromT1}) {
    const DepthCorrection correction = consensus(r, t2_from_epoch);
    // Five photos see it, so a fifth of it is the mean; Tukey's weight and the pairs' alignment
    // leave some more.
    EXPECT_LT(worst(r, correction, kFrame, true), 0.0025);
    // The others are moved by a fifth of it, and by what is interpolated.
    for (const int frame : {1, 3}) EXPECT_LT(worst(r, correction, frame, false), 0.002);
  }
}

TEST(DepthConsensus, LeavesDepthsAloneThatAgree) {
  const Reconstruction r = walk(5);
  const DepthCorrection correction = consensus(r);
  // Depths between pixels are interpolated: a thousandth on these waves.
  for (int frame = 0; frame < 5; ++frame) EXPECT_LT(worst(r, correction, frame, false), 1e-3);
}

TEST(DepthConsensus, OfOnePhotoIsWhatItSays) {
  const Reconstruction r = walk(1);
  EXPECT_EQ(worst(r, consensus(r), 0, false), 0);
}

TEST(DepthCorrection, IsLinearBetweenItsNodes) {
  DepthCorrection correction(2, 10, 14, 4);
  ASSERT_EQ(correction.rows(), 4u);
  ASSERT_EQ(correction.columns(), 5u);
  correction.node(1, 1, 2) = 2;
  const PhotoCorrection photo = correction.photo(1);
  EXPECT_EQ(photo.factor(8, 4), 2);
  EXPECT_EQ(photo.factor(9, 4), 1.75f);
  EXPECT_EQ(photo.factor(8, 6), 1.5f);
  EXPECT_EQ(photo.factor(13, 9), 1);  // the last pixel
  EXPECT_EQ(photo.nearest(9, 5), 2);
  EXPECT_EQ(photo.nearest(11, 5), 1);
  EXPECT_EQ(correction.photo(0).factor(8, 4), 1);
  EXPECT_EQ(DepthCorrection().photo(3).factor(8, 4), 1);
}

}  // namespace
}  // namespace vggtcd
