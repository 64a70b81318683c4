// SPDX-License-Identifier: Apache-2.0
// PhotoAnswers: what the votes say about the pixels of one photo.
#include "vggtcd/change/photo_answers.h"

#include <cmath>
#include <limits>

#include "vggtcd/change/photo_tallies.h"

namespace vggtcd {
namespace {

// Photos that look at one place from the same side err in common, so this many count as one. So
// many make the confidence the share of right answers on the generated scenes of seed 101
// (docs/numerics.md).
constexpr double kPhotosThatErrAlike = 6;

// Turns the votes about a pixel into its answer.
void answer(const Tally& tally, ChangeLabel changed, const FreeSpaceOptions& options,
            double registration_variance, size_t pixel, PhotoAnswers& answers) {
  const double photos = static_cast<double>(tally.count / tally.points);
  answers.label[pixel] = ChangeLabel::kUnobserved;
  if (photos < options.min_votes || !(tally.weight > 0)) return;
  const double through = static_cast<double>(tally.through / tally.weight);
  const bool is_changed = through >= options.min_through_share;
  answers.label[pixel] = is_changed ? changed : ChangeLabel::kUnchanged;
  answers.gap[pixel] = tally.gap / tally.weight;
  answers.evidence[pixel] = tally.evidence / tally.weight;
  // Agresti and Coull: two votes of either side added, so that unanimity of a few is not certainty.
  const double share = (photos * through + 2) / (photos + 4);
  const double deviation = std::sqrt(kPhotosThatErrAlike * share * (1 - share) / (photos + 4));
  const double side = (is_changed ? 1 : -1) * (through - options.min_through_share) / deviation;
  answers.confidence[pixel] = static_cast<float>(0.5 * std::erfc(-side / std::sqrt(2.0)));
  const double sigma = static_cast<double>(tally.sigma / tally.weight);
  // The gap of a pair has the variance of both its surfaces; the other epoch's is the mean of the
  // photos that voted, the own one's is this photo's.
  const double surfaces = 0.5 * sigma * sigma * (1 + 1 / photos);
  answers.level_of_detection[pixel] =
      static_cast<float>(1.96 * (std::sqrt(surfaces) + std::sqrt(registration_variance)));
}

// The majority of the judged labels (unchanged, changed) in the window; a single pixel is noise.
// Where it overrules the votes about the pixel, the two are one against one.
void median_filter(PhotoAnswers& answers, int width, int height, ChangeLabel changed, int radius) {
  if (radius <= 0) return;
  const std::vector<ChangeLabel> before = answers.label;
  const auto index = [&](int x, int y) {
    return static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
  };
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      const ChangeLabel own = before[index(u, v)];
      if (own != changed && own != ChangeLabel::kUnchanged) continue;
      int for_change = 0, judged = 0;
      for (int y = std::max(0, v - radius); y <= std::min(height - 1, v + radius); ++y) {
        for (int x = std::max(0, u - radius); x <= std::min(width - 1, u + radius); ++x) {
          const ChangeLabel label = before[index(x, y)];
          for_change += label == changed ? 1 : 0;
          judged += label == changed || label == ChangeLabel::kUnchanged ? 1 : 0;
        }
      }
      const ChangeLabel majority = 2 * for_change > judged ? changed : ChangeLabel::kUnchanged;
      if (2 * for_change == judged || majority == own) continue;
      answers.label[index(u, v)] = majority;
      answers.confidence[index(u, v)] = 0.5f;
    }
  }
}

}  // namespace

PhotoAnswers::PhotoAnswers(size_t pixels) : label(pixels, ChangeLabel::kNoEvidence) {
  for (auto* values : {&gap, &evidence, &confidence, &level_of_detection}) {
    values->assign(pixels, std::numeric_limits<float>::quiet_NaN());
  }
}

PhotoAnswers answer_photo(const Inquiry& inquiry, int frame, const VoteGrid& grid,
                          ChangeLabel changed, const VoteScale& scale,
                          const FreeSpaceOptions& options) {
  const Reconstruction& judged = inquiry.judged();
  const std::span<const float> depth = judged.frame_depth(frame);
  const PhotoTallies tallies(inquiry, frame, grid, scale);
  PhotoAnswers answers(judged.pixels_per_frame());
  const PixelRays rays = inquiry.rays(frame);
  size_t pixel = 0;
  for (int v = 0; v < judged.height; ++v) {
    for (int u = 0; u < judged.width; ++u, ++pixel) {
      if (!(depth[pixel] > 0) || (!options.fill && !tallies.asked(u, v))) continue;
      const Tally around = tallies.around(u, v, options.smooth_radius);
      if (!(around.points > 0)) continue;
      const double variance = scale.registration(rays.point(u, v, depth[pixel]).cast<double>());
      answer(around, changed, options, variance, pixel, answers);
    }
  }
  median_filter(answers, judged.width, judged.height, changed, options.median_radius_px);
  return answers;
}

}  // namespace vggtcd
