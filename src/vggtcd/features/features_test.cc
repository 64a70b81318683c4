// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/features/features.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "vggtcd/core/parallel.h"

namespace vggtcd {
namespace {

Features random_features(int count, unsigned seed) {
  std::mt19937 random(seed);
  std::gamma_distribution<double> value(0.5);
  Features features;
  for (int i = 0; i < count; ++i) {
    std::vector<double> v(kDescriptorSize);
    double sum = 0;
    for (double& x : v) sum += x = value(random);
    for (const double x : v) {
      features.descriptors.push_back(static_cast<int16_t>(std::lround(512 * std::sqrt(x / sum))));
    }
    features.points.push_back({0, 0, 1, 0});
  }
  return features;
}

// The definition: for each descriptor all angles, sorted.
std::vector<std::pair<int, int>> matches_by_definition(const Features& a, const Features& b) {
  const auto nearest = [](const Features& from, size_t i, const Features& to) {
    std::vector<std::pair<double, int>> angles;
    for (size_t j = 0; j < to.points.size(); ++j) {
      double product = 0;
      for (size_t k = 0; k < kDescriptorSize; ++k) {
        product += double{1} * from.descriptors[i * kDescriptorSize + k] *
                   to.descriptors[j * kDescriptorSize + k];
      }
      angles.emplace_back(std::acos(std::min(1.0, product / (512.0 * 512.0))), static_cast<int>(j));
    }
    std::sort(angles.begin(), angles.end());
    const bool distinct = angles[0].first < 0.7 && angles[0].first < 0.8 * angles[1].first;
    return distinct ? angles[0].second : -1;
  };
  std::vector<std::pair<int, int>> matches;
  for (size_t i = 0; i < a.points.size(); ++i) {
    const int j = nearest(a, i, b);
    if (j >= 0 && nearest(b, static_cast<size_t>(j), a) == static_cast<int>(i)) {
      matches.emplace_back(static_cast<int>(i), j);
    }
  }
  return matches;
}

TEST(MatchDescriptors, FindsWhatTheDefinitionFinds) {
  Features a = random_features(61, 1);
  Features b = random_features(83, 2);
  // Some of b are disturbed copies of a's: more and more disturbed, so that some fail the test.
  std::mt19937 random(3);
  for (size_t i = 0; i < 40; ++i) {
    std::normal_distribution<double> noise(0, 1.0 * static_cast<double>(i));
    for (size_t k = 0; k < kDescriptorSize; ++k) {
      b.descriptors[(i + 7) * kDescriptorSize + k] = static_cast<int16_t>(
          std::max(0.0, a.descriptors[i * kDescriptorSize + k] + noise(random)));
    }
  }
  const auto expected = matches_by_definition(a, b);
  ASSERT_GT(expected.size(), 10u);
  ASSERT_LT(expected.size(), 40u);
  std::vector<std::pair<int, int>> found;
  for (const Match& m : match_descriptors(a, b)) found.emplace_back(m.first, m.second);
  EXPECT_EQ(found, expected);
}

TEST(MatchDescriptorsNear, ComparesOnlyWhatLiesWhereItIsExpected) {
  Features a = random_features(30, 1), b = random_features(30, 2);
  b.descriptors = a.descriptors;  // each has its own twin, and all points lie at the origin
  constexpr float kNowhere = std::numeric_limits<float>::quiet_NaN();
  std::vector<Eigen::Vector2f> of_a(30, {kNowhere, kNowhere}), of_b = of_a;
  EXPECT_TRUE(match_descriptors_near(a, b, of_a, of_b, 5).empty());
  of_a[7] = {3, 3.9f};   // 4.9 px away
  of_b[8] = {-3, 3.9f};  // expected from the other side
  of_a[9] = {3, 4.1f};   // 5.1
  const auto matches = match_descriptors_near(a, b, of_a, of_b, 5);
  ASSERT_EQ(matches.size(), 2u);
  EXPECT_EQ(matches[0].first, 7);
  EXPECT_EQ(matches[0].second, 7);
  EXPECT_EQ(matches[1].first, 8);
}

TEST(MatchDescriptorsNear, FindsTheSameAsMatchDescriptorsWithinReachOfAll) {
  Features a = random_features(61, 1), b = random_features(83, 2);
  std::copy_n(a.descriptors.begin(), 40 * kDescriptorSize, b.descriptors.begin());
  const std::vector<Eigen::Vector2f> of_a(61, {0, 0}), of_b(83, {0, 0});
  const auto expected = match_descriptors(a, b);
  const auto actual = match_descriptors_near(a, b, of_a, of_b, 1);
  ASSERT_GE(expected.size(), 40u);
  ASSERT_EQ(actual.size(), expected.size());
  for (size_t i = 0; i < actual.size(); ++i) {
    EXPECT_EQ(actual[i].first, expected[i].first);
    EXPECT_EQ(actual[i].second, expected[i].second);
  }
}

TEST(MatchDescriptors, FindsNothingInAnEmptyPhoto) {
  EXPECT_TRUE(match_descriptors(random_features(5, 1), Features{}).empty());
  EXPECT_TRUE(match_descriptors(Features{}, random_features(5, 1)).empty());
}

// A wall of random discs, seen through a window that starts at (left, top).
Image wall(int left, int top) {
  Image image(320, 240);
  std::mt19937 random(5);
  std::fill(image.rgb.begin(), image.rgb.end(), uint8_t{90});
  for (int disc = 0; disc < 400; ++disc) {
    const int x = static_cast<int>(random() % 400), y = static_cast<int>(random() % 300);
    const int radius = 3 + static_cast<int>(random() % 10);
    const auto color = static_cast<uint8_t>(random() % 256);
    for (int v = std::max(0, y - top - radius); v < std::min(240, y - top + radius); ++v) {
      for (int u = std::max(0, x - left - radius); u < std::min(320, x - left + radius); ++u) {
        const int du = u + left - x, dv = v + top - y;
        if (du * du + dv * dv < radius * radius) std::fill_n(image.pixel(u, v), 3, color);
      }
    }
  }
  return image;
}

TEST(MatchAll, FindsTheShiftOfAWallAndThatItIsAPlaneWithTheSameBitsForAnyThreads) {
  const std::vector<Image> photos = {wall(0, 0), wall(23, 11), wall(60, 40)};
  std::vector<std::vector<PhotoPair>> found;
  for (const int threads : {1, 3}) {
    set_num_threads(threads);
    ProgressStage stage(silent_progress(), "test");
    const auto features = extract_features(photos, 500, stage);
    found.push_back(match_all(features, 15, stage));
    ASSERT_EQ(found.back().size(), 3u);
    const PhotoPair& pair = found.back().front();
    int shifted = 0;
    for (const Match& m : pair.matches) {
      const KeyPoint& p = features[0].points[static_cast<size_t>(m.first)];
      const KeyPoint& q = features[1].points[static_cast<size_t>(m.second)];
      shifted += std::hypot(p.u_px - q.u_px - 23, p.v_px - q.v_px - 11) < 0.5f ? 1 : 0;
    }
    const auto matches = static_cast<int>(pair.matches.size());
    EXPECT_GT(shifted, matches * 9 / 10) << matches;
    EXPECT_GT(pair.homography_inliers, matches * 9 / 10);
  }
  set_num_threads(2);
  for (size_t i = 0; i < 3; ++i) {
    ASSERT_EQ(found[0][i].matches.size(), found[1][i].matches.size());
    for (size_t k = 0; k < found[0][i].matches.size(); ++k) {
      EXPECT_EQ(found[0][i].matches[k].first, found[1][i].matches[k].first);
      EXPECT_EQ(found[0][i].matches[k].second, found[1][i].matches[k].second);
    }
  }
}

TEST(ExtractFeatures, FindsASpotWhereItIs) {
  constexpr double kU = 101, kV = 83.5, kSigma_px = 4;
  Image photo(200, 160);
  for (int v = 0; v < photo.height; ++v) {
    for (int u = 0; u < photo.width; ++u) {
      const double away = std::hypot(u - kU, v - kV) / kSigma_px;
      std::fill_n(photo.pixel(u, v), 3,
                  static_cast<uint8_t>(std::lround(60 + 150 * std::exp(-0.5 * away * away))));
    }
  }
  const Features features = extract_features(photo, 100);
  ASSERT_FALSE(features.points.empty());
  EXPECT_NEAR(features.points[0].u_px, kU, 0.05);
  EXPECT_NEAR(features.points[0].v_px, kV, 0.05);
}

TEST(ExtractFeatures, OfAShrunkPhotoHasItsKeyPointsInTheOriginalsPixels) {
  const Image photo = wall(0, 0);
  const Features full = extract_features(photo, 5000), shrunk = extract_features(photo, 5000, 160);
  ASSERT_GT(shrunk.points.size(), 20u);
  // Of the same place and size in both: no shift on average, where half a pixel would be forgotten.
  double shift_u = 0, shift_v = 0;
  int found = 0;
  for (const KeyPoint& p : shrunk.points) {
    for (const KeyPoint& q : full.points) {
      if (std::hypot(p.u_px - q.u_px, p.v_px - q.v_px) > 1.2f ||
          std::abs(std::log(p.scale_px / q.scale_px)) > 0.2f) {
        continue;
      }
      shift_u += static_cast<double>(p.u_px - q.u_px);
      shift_v += static_cast<double>(p.v_px - q.v_px);
      ++found;
    }
  }
  ASSERT_GT(found, 100);
  EXPECT_LT(std::abs(shift_u / found), 0.15);
  EXPECT_LT(std::abs(shift_v / found), 0.15);
}

}  // namespace
}  // namespace vggtcd
