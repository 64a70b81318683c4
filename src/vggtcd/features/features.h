// SPDX-License-Identifier: Apache-2.0
// Sparse correspondences between photos: SIFT key points, their matches, and which of the matches
// one fundamental matrix explains. Ours rather than COLMAP's because COLMAP matches 300 pairs on a
// processor in 100 s (these loops: 5 s at as many features) and its parallel matcher gives other
// bytes every time.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "vggtcd/core/progress.h"
#include "vggtcd/scene/image.h"

namespace vggtcd {

constexpr int kDescriptorSize = 128;

struct KeyPoint {
  float u_px, v_px;  // pixel centres are integers
  float scale_px, angle_rad;
};

struct Features {
  std::vector<KeyPoint> points;
  std::vector<int16_t> descriptors;  // [n, 128], square roots of L1-normalised SIFT, times 512
};

struct Match {
  int32_t first, second;  // key point numbers
};

// Two photos that see the same thing.
struct PhotoPair {
  int first = 0, second = 0;   // photo numbers, first < second
  std::vector<Match> matches;  // those that the fundamental matrix explains
  int homography_inliers = 0;  // of them, those that one homography explains as well
};

// At most max_points largest SIFT key points of a photo, which is shrunk before so that its longer
// side has at most max_side_px; key points are in its own pixels.
Features extract_features(const Image& photo, int max_points,
                          int max_side_px = std::numeric_limits<int>::max());

// The same of each photo, in parallel. Sets OpenCV to one thread for the process: its own would
// race with ours for the order.
std::vector<Features> extract_features(const std::vector<Image>& photos, int max_points,
                                       ProgressStage& stage,
                                       int max_side_px = std::numeric_limits<int>::max());

// Mutual nearest neighbours whose distance (angle between descriptors) is below 0.8 of the distance
// to the second nearest.
std::vector<Match> match_descriptors(const Features& first, const Features& second);

// The same among key points that lie within radius_px of where the other one is expected, from
// either side: expected_of_first[i] is the pixel in the second photo (NaN: nowhere).
std::vector<Match> match_descriptors_near(const Features& first, const Features& second,
                                          std::span<const Eigen::Vector2f> expected_of_first,
                                          std::span<const Eigen::Vector2f> expected_of_second,
                                          float radius_px);

// Every pair of photos with at least min_inliers matches within 4 px of their epipolar lines.
std::vector<PhotoPair> match_all(const std::vector<Features>& features, int min_inliers,
                                 ProgressStage& stage);

}  // namespace vggtcd
