// SPDX-License-Identifier: Apache-2.0
// Sparse correspondences between photos: SIFT (Lowe 2004) with root descriptors (Arandjelovic and
// Zisserman 2012), ratio test, and RANSAC, both from OpenCV.
#include "vggtcd/features/features.h"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"

namespace vggtcd {
namespace {

// Below it matches are chance: COLMAP's values.
constexpr double kMaxRatio = 0.8;
constexpr double kMaxAngleRad = 0.7;
constexpr double kUnit = 512.0;  // a descriptor's length; products fit 32 bits
constexpr double kMaxEpipolarError_px = 4.0;
// OpenCV doubles the photo first, which puts pixel x at 2 x + 0.5, and halves what it finds there
// (its later option enable_precise_upscale is for that).
constexpr float kDoublingBias_px = 0.25f;
constexpr int kBlock = 16;  // rows of a block of the product, so that its columns stay in L1

cv::Mat gray_of(const Image& photo) {
  const cv::Mat rgb(photo.height, photo.width, CV_8UC3, const_cast<uint8_t*>(photo.rgb.data()));
  cv::Mat gray;
  cv::cvtColor(rgb, gray, cv::COLOR_RGB2GRAY);
  return gray;
}

void append_root_descriptor(const float* sift, std::vector<int16_t>& out) {
  double sum = 0;
  for (int i = 0; i < kDescriptorSize; ++i) sum += sift[i];
  for (int i = 0; i < kDescriptorSize; ++i) {
    const double root = std::sqrt(sift[i] / std::max(sum, 1e-9));
    out.push_back(static_cast<int16_t>(std::lround(kUnit * root)));
  }
}

int32_t dot(const int16_t* a, const int16_t* b) {
  int32_t sum = 0;
  for (int i = 0; i < kDescriptorSize; ++i) sum += a[i] * b[i];
  return sum;
}

// The two largest products of a descriptor with those of the other photo.
struct Nearest {
  int32_t best = -1, second = -1;
  int32_t index = -1;
  void see(int32_t product, int32_t i) {
    if (product > best) {
      second = best;
      best = product;
      index = i;
    } else if (product > second) {
      second = product;
    }
  }
  bool distinct() const {
    const auto angle = [](int32_t product) {
      return std::acos(std::min(1.0, product / (kUnit * kUnit)));
    };
    return index >= 0 && angle(best) < kMaxAngleRad && angle(best) < kMaxRatio * angle(second);
  }
};

std::vector<Match> mutual(const std::vector<Nearest>& of_first,
                          const std::vector<Nearest>& of_second) {
  std::vector<Match> matches;
  for (size_t i = 0; i < of_first.size(); ++i) {
    if (!of_first[i].distinct()) continue;
    const Nearest& back = of_second[static_cast<size_t>(of_first[i].index)];
    if (back.index == static_cast<int32_t>(i) && back.distinct()) {
      matches.push_back({static_cast<int32_t>(i), of_first[i].index});
    }
  }
  return matches;
}

PhotoPair verified(int first, int second, const std::vector<Features>& features,
                   const std::vector<Match>& matches, int min_inliers) {
  PhotoPair pair{first, second, {}, 0};
  if (static_cast<int>(matches.size()) < min_inliers) return pair;
  std::vector<cv::Point2f> a, b;
  for (const Match& m : matches) {
    const KeyPoint& p = features[static_cast<size_t>(first)].points[static_cast<size_t>(m.first)];
    const KeyPoint& q = features[static_cast<size_t>(second)].points[static_cast<size_t>(m.second)];
    a.emplace_back(p.u_px, p.v_px);
    b.emplace_back(q.u_px, q.v_px);
  }
  constexpr double kConfidence = 0.9999;
  constexpr int kTrials = 5000;
  std::vector<uint8_t> inlier;
  cv::findFundamentalMat(a, b, cv::USAC_DEFAULT, kMaxEpipolarError_px, kConfidence, kTrials,
                         inlier);
  std::vector<cv::Point2f> kept_a, kept_b;
  for (size_t i = 0; i < inlier.size(); ++i) {
    if (!inlier[i]) continue;
    pair.matches.push_back(matches[i]);
    kept_a.push_back(a[i]);
    kept_b.push_back(b[i]);
  }
  if (static_cast<int>(pair.matches.size()) < min_inliers) {
    pair.matches.clear();
    return pair;
  }
  std::vector<uint8_t> planar;
  cv::findHomography(kept_a, kept_b, cv::USAC_DEFAULT, kMaxEpipolarError_px, planar, kTrials,
                     kConfidence);
  pair.homography_inliers = static_cast<int>(std::count(planar.begin(), planar.end(), 1));
  return pair;
}

}  // namespace

Features extract_features(const Image& photo, int max_points, int max_side_px) {
  constexpr double kContrast = 0.02, kEdge = 10, kSigma = 1.6;
  std::vector<cv::KeyPoint> points;
  cv::Mat descriptors;
  const cv::Ptr<cv::SIFT> sift = cv::SIFT::create(0, 3, kContrast, kEdge, kSigma);
  cv::Mat gray = gray_of(photo);
  const float shrink = std::min(
      1.0f, static_cast<float>(max_side_px) / static_cast<float>(std::max(gray.cols, gray.rows)));
  if (shrink < 1) cv::resize(gray, gray, {}, shrink, shrink, cv::INTER_AREA);
  sift->detect(gray, points);
  // The largest, not the strongest: they are found again from farther away.
  std::stable_sort(points.begin(), points.end(),
                   [](const cv::KeyPoint& a, const cv::KeyPoint& b) { return a.size > b.size; });
  if (points.size() > static_cast<size_t>(max_points))
    points.resize(static_cast<size_t>(max_points));
  sift->compute(gray, points, descriptors);
  Features features;
  for (size_t i = 0; i < points.size(); ++i) {
    const cv::KeyPoint& p = points[i];
    // Pixel centres are integers: those of the two sizes meet at the corner, half a pixel before 0.
    const float u = p.pt.x - kDoublingBias_px, v = p.pt.y - kDoublingBias_px;
    features.points.push_back({(u + 0.5f) / shrink - 0.5f, (v + 0.5f) / shrink - 0.5f,
                               p.size / shrink, static_cast<float>(p.angle * CV_PI / 180.0)});
    append_root_descriptor(descriptors.ptr<float>(static_cast<int>(i)), features.descriptors);
  }
  return features;
}

std::vector<Features> extract_features(const std::vector<Image>& photos, int max_points,
                                       ProgressStage& stage, int max_side_px) {
  cv::setNumThreads(1);
  std::vector<Features> features(photos.size());
  const auto count = static_cast<int64_t>(photos.size());
  const int64_t slab = 2 * num_threads();
  for (int64_t begin = 0; begin < count; begin += slab) {
    parallel_for(std::min(slab, count - begin), 1, [&](int64_t from, int64_t to) {
      for (int64_t i = begin + from; i < begin + to; ++i) {
        features[static_cast<size_t>(i)] =
            extract_features(photos[static_cast<size_t>(i)], max_points, max_side_px);
      }
    });
    stage.advance(static_cast<double>(begin + slab) / static_cast<double>(count));
  }
  return features;
}

std::vector<Match> match_descriptors(const Features& first, const Features& second) {
  const size_t n = first.points.size(), m = second.points.size();
  std::vector<Nearest> of_first(n), of_second(m);
  for (size_t block = 0; block < n; block += kBlock) {
    const size_t end = std::min(n, block + kBlock);
    for (size_t j = 0; j < m; ++j) {
      const int16_t* b = second.descriptors.data() + j * kDescriptorSize;
      for (size_t i = block; i < end; ++i) {
        const int32_t product = dot(first.descriptors.data() + i * kDescriptorSize, b);
        of_first[i].see(product, static_cast<int32_t>(j));
        of_second[j].see(product, static_cast<int32_t>(i));
      }
    }
  }
  return mutual(of_first, of_second);
}

std::vector<Match> match_descriptors_near(const Features& first, const Features& second,
                                          std::span<const Eigen::Vector2f> expected_of_first,
                                          std::span<const Eigen::Vector2f> expected_of_second,
                                          float radius_px) {
  check(expected_of_first.size() == first.points.size() &&
            expected_of_second.size() == second.points.size(),
        "match_descriptors_near: one expected pixel per key point");
  const auto near = [&](const Eigen::Vector2f& expected, const KeyPoint& point) {
    return (expected - Eigen::Vector2f(point.u_px, point.v_px)).squaredNorm() <
           radius_px * radius_px;  // false for NaN
  };
  std::vector<Nearest> of_first(first.points.size()), of_second(second.points.size());
  for (size_t i = 0; i < of_first.size(); ++i) {
    for (size_t j = 0; j < of_second.size(); ++j) {
      if (!near(expected_of_first[i], second.points[j]) &&
          !near(expected_of_second[j], first.points[i])) {
        continue;
      }
      const int32_t product = dot(first.descriptors.data() + i * kDescriptorSize,
                                  second.descriptors.data() + j * kDescriptorSize);
      of_first[i].see(product, static_cast<int32_t>(j));
      of_second[j].see(product, static_cast<int32_t>(i));
    }
  }
  return mutual(of_first, of_second);
}

std::vector<PhotoPair> match_all(const std::vector<Features>& features, int min_inliers,
                                 ProgressStage& stage) {
  cv::setNumThreads(1);
  std::vector<PhotoPair> pairs;
  for (int i = 0; i < static_cast<int>(features.size()); ++i) {
    for (int j = i + 1; j < static_cast<int>(features.size()); ++j) pairs.push_back({i, j, {}, 0});
  }
  const auto count = static_cast<int64_t>(pairs.size());
  const int64_t slab = 8 * num_threads();
  for (int64_t begin = 0; begin < count; begin += slab) {
    parallel_for(std::min(slab, count - begin), 1, [&](int64_t from, int64_t to) {
      for (int64_t i = begin + from; i < begin + to; ++i) {
        PhotoPair& pair = pairs[static_cast<size_t>(i)];
        const auto matches = match_descriptors(features[static_cast<size_t>(pair.first)],
                                               features[static_cast<size_t>(pair.second)]);
        pair = verified(pair.first, pair.second, features, matches, min_inliers);
      }
    });
    stage.advance(static_cast<double>(begin + slab) / static_cast<double>(count));
  }
  std::erase_if(pairs, [](const PhotoPair& pair) { return pair.matches.empty(); });
  return pairs;
}

}  // namespace vggtcd
