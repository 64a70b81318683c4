// SPDX-License-Identifier: Apache-2.0
// Why a pixel got its answer: what each photo of the other epoch said about it, and what became of
// the votes.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "vggtcd/change/change_label.h"
#include "vggtcd/change/witness.h"
#include "vggtcd/scene/reconstruction.h"

namespace vggtcd {

// A pixel of a photo as it was analysed; (0, 0) is the top left one.
struct PixelQuestion {
  bool in_after = false;  // the photo is one of T2, else of T1
  int frame = 0;
  int x = 0, y = 0;
};

// Its place in the pixels of its epoch [S, H, W].
inline size_t pixel_index(const PixelQuestion& at, const Reconstruction& epoch) {
  return static_cast<size_t>(at.frame) * epoch.pixels_per_frame() +
         static_cast<size_t>(at.y) * static_cast<size_t>(epoch.width) + static_cast<size_t>(at.x);
}

// "X,Y,PHOTO", PHOTO one of before/NAME and after/NAME, or the photo's number from 0 instead of its
// name. Throws Error{kUsage} naming the option if the text is not one, if there is no such photo,
// or if the pixel lies outside it.
PixelQuestion parse_pixel_question(std::string_view text, const Reconstruction& before,
                                   const Reconstruction& after,
                                   std::string_view option = "explain");

// The same of the text alone, before any photo is known. Throws Error{kUsage}.
void check_pixel_question(std::string_view text, std::string_view option = "explain");

struct PhotoTestimony {
  std::string photo;   // of the other epoch: before/NAME or after/NAME
  int x = -1, y = -1;  // where the point falls; -1 outside
  Testimony said;
  int weight = 0;  // of its vote; 0: none
};

struct PixelExplanation {
  PixelQuestion question;
  std::string photo;                   // before/NAME or after/NAME
  bool voted = false;                  // the pixel itself asked, else its surroundings alone answer
  std::vector<PhotoTestimony> photos;  // all that were asked about this photo, best overlap first
  // Fused over the voxel and the surface around the pixel.
  double votes = 0;          // photos that could tell
  double through_share = 0;  // of their weight; NaN without votes
  double min_through_share = 0;
  ChangeLabel label = ChangeLabel::kNoEvidence;
  float confidence = 0, gap_u = 0, level_of_detection_u = 0;  // NaN where nothing was judged
};

// The answer and its reasons in a sentence or two; `unit` is that of the lengths.
std::string explanation_sentence(const PixelExplanation& explanation,
                                 std::string_view unit = "scene units");

// A line per photo that was asked, under a header, each ended by a newline.
std::string explanation_table(const PixelExplanation& explanation);

}  // namespace vggtcd
