// SPDX-License-Identifier: Apache-2.0
// PhotoAnswers: what the votes say about the pixels of one photo.
#pragma once

#include <vector>

#include "vggtcd/change/change_label.h"
#include "vggtcd/change/free_space_options.h"
#include "vggtcd/change/inquiry.h"

namespace vggtcd {

// All [H, W]. Fused over voxels and the surface around a pixel; NaN where nothing was judged.
struct PhotoAnswers {
  std::vector<ChangeLabel> label;
  // Signed gap: how far the other epoch sees beyond the point along its rays (T2 units), the mean;
  // positive: looked through.
  std::vector<float> gap;
  // The mean gap in sigmas of the pairs, each held between -8 and 8: ranks best.
  std::vector<float> evidence;
  // The probability, 0 to 1, that the share of votes is on the side of its threshold that the label
  // says, from the number of photos that voted and how they disagree. A half where the median of
  // the labels around overruled the votes.
  std::vector<float> confidence;
  // Smallest distance that is significant at 95 % here, T2 units: 1.96 (sqrt(s1^2 / 1 + s2^2 / n) +
  // r), s1^2 = s2^2 = sigma^2 / 2, sigma the spread of the gaps of a pair of photos where nothing
  // changed, n the photos of the other epoch that voted, r the uncertainty of the registration here
  // (M3C2: Lague et al. 2013, eq. 1).
  std::vector<float> level_of_detection;

  explicit PhotoAnswers(size_t pixels);
};

// Reads the fused votes back into a photo of the judged epoch. changed: what a change is called
// there. The labels have been through the median filter of the options.
PhotoAnswers answer_photo(const Inquiry& inquiry, int frame, const VoteGrid& grid,
                          ChangeLabel changed, const VoteScale& scale,
                          const FreeSpaceOptions& options);

}  // namespace vggtcd
