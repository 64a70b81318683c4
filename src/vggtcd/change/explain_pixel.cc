// SPDX-License-Identifier: Apache-2.0
// Asks again about one pixel, and keeps what every photo said.
#include "vggtcd/change/explain_pixel.h"

#include <limits>

#include "vggtcd/change/photo_answers.h"
#include "vggtcd/change/photo_tallies.h"

namespace vggtcd {
namespace {

std::vector<PhotoTestimony> testimonies(const Inquiry& inquiry, const PixelQuestion& question,
                                        const Eigen::Vector3f& x_in_t2, const VoteScale& scale) {
  std::vector<PhotoTestimony> photos;
  const std::string other_epoch = question.in_after ? "before/" : "after/";
  inquiry.for_each_witness(
      question.frame, x_in_t2, scale.tolerance_sigmas, [&](size_t k, const Testimony& said) {
        const int asked = inquiry.views(question.frame)[k];
        const View& view = inquiry.witness().epoch->views[static_cast<size_t>(asked)];
        PhotoTestimony photo{other_epoch + view.name, -1, -1, said, 0};
        if (said.vote != Vote::kOutside) {
          photo.x = said.column;
          photo.y = said.row;
        }
        PointVotes votes;
        votes.cast(said, scale);
        photo.weight = votes.weight;
        photos.push_back(std::move(photo));
      });
  return photos;
}

}  // namespace

PixelExplanation explain_pixel(const Inquiry& inquiry, const PixelQuestion& question,
                               const VoteGrid& grid, ChangeLabel changed, const VoteScale& scale,
                               const FreeSpaceOptions& options) {
  const Reconstruction& judged = inquiry.judged();
  const size_t i = static_cast<size_t>(question.frame);
  const size_t pixel = pixel_index(question, judged);
  const size_t in_frame = pixel % judged.pixels_per_frame();
  PixelExplanation why;
  why.question = question;
  why.photo = (question.in_after ? "after/" : "before/") + judged.views[i].name;
  why.min_through_share = options.min_through_share;
  why.through_share = std::numeric_limits<double>::quiet_NaN();
  why.voted = inquiry.asks(pixel);
  const PhotoAnswers answers = answer_photo(inquiry, question.frame, grid, changed, scale, options);
  why.label = answers.label[in_frame];
  why.confidence = answers.confidence[in_frame];
  why.gap_u = answers.gap[in_frame];
  why.level_of_detection_u = answers.level_of_detection[in_frame];
  if (!(judged.depth[pixel] > 0)) return why;
  const Eigen::Vector3f x = inquiry.point(question.frame, question.x, question.y);
  why.photos = testimonies(inquiry, question, x, scale);
  const Tally around = PhotoTallies(inquiry, question.frame, grid, scale)
                           .around(question.x, question.y, options.smooth_radius);
  if (around.points > 0) why.votes = static_cast<double>(around.count / around.points);
  if (around.weight > 0) why.through_share = static_cast<double>(around.through / around.weight);
  return why;
}

}  // namespace vggtcd
