// SPDX-License-Identifier: Apache-2.0
// Why a pixel got its answer.
#include "vggtcd/change/explanation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "vggtcd/core/number_text.h"

namespace vggtcd {
namespace {

struct QuestionText {
  PixelQuestion question;  // but for the frame
  std::string_view photo;
};

QuestionText split_question(std::string_view text, std::string_view option) {
  const size_t first = text.find(','), second = text.find(',', first + 1);
  const size_t slash = second == text.npos ? text.npos : text.find('/', second);
  std::optional<int> x, y;
  std::string_view epoch;
  if (first != text.npos && slash != text.npos) {
    x = number_in<int>(text.substr(0, first));
    y = number_in<int>(text.substr(first + 1, second - first - 1));
    epoch = text.substr(second + 1, slash - second - 1);
  }
  if (!x || !y || (epoch != "before" && epoch != "after")) {
    throw_error(ErrorCode::kUsage, "{}: expected X,Y,before/PHOTO or X,Y,after/PHOTO, found \"{}\"",
                option, text);
  }
  return {{epoch == "after", 0, *x, *y}, text.substr(slash + 1)};
}

}  // namespace

void check_pixel_question(std::string_view text, std::string_view option) {
  split_question(text, option);
}

PixelQuestion parse_pixel_question(std::string_view text, const Reconstruction& before,
                                   const Reconstruction& after, std::string_view option) {
  auto [question, photo] = split_question(text, option);
  const Reconstruction& epoch = question.in_after ? after : before;
  const auto frame = find_frame(epoch, photo);
  if (!frame) {
    throw_error(ErrorCode::kUsage,
                "{}: no photo \"{}\" in the {} epoch; give one of its names ({}, ...) or a "
                "number from 0 to {}",
                option, photo, question.in_after ? "after" : "before", epoch.views.front().name,
                epoch.num_frames() - 1);
  }
  question.frame = *frame;
  if (question.x < 0 || question.x >= epoch.width || question.y < 0 || question.y >= epoch.height) {
    throw_error(
        ErrorCode::kUsage,
        "{}: pixel {},{} lies outside the photo, which was analysed at {} x {}: give X from "
        "0 to {} and Y from 0 to {}",
        option, question.x, question.y, epoch.width, epoch.height, epoch.width - 1,
        epoch.height - 1);
  }
  return question;
}

std::string explanation_sentence(const PixelExplanation& why, std::string_view unit) {
  const std::string where =
      fmt::format("Pixel {},{} of {}", why.question.x, why.question.y, why.photo);
  if (why.label == ChangeLabel::kNoEvidence) {
    return fmt::format("{}: no evidence, for it has no depth or one too uncertain to be judged.",
                       where);
  }
  std::string text = where + ": ";
  if (why.label == ChangeLabel::kUnobserved) {
    text += fmt::format(
        "unobserved, for around it only {:.1f} photos of the other epoch could tell on average.",
        why.votes);
  } else {
    text += fmt::format(
        "{} with confidence {:.2f}. Around it {:.1f} photos could tell on average, and {:.0f} % of "
        "their weight looks "
        "through (changed from {:.0f} %); mean gap {:.3g} {}, level of detection {:.3g} {}.",
        enum_to_string(why.label), why.confidence, why.votes, 100 * why.through_share,
        100 * why.min_through_share, why.gap_u, unit, why.level_of_detection_u, unit);
    if (is_change(why.label) != (why.through_share >= why.min_through_share)) {
      text += " The votes alone say otherwise; the median of the pixels around it decided.";
    }
  }
  if (!why.voted) {
    text += " The pixel itself is too uncertain to ask: the answer is that of the surface around.";
  }
  return text;
}

std::string explanation_table(const PixelExplanation& why) {
  size_t name_width = 5;
  for (const PhotoTestimony& photo : why.photos)
    name_width = std::max(name_width, photo.photo.size());
  std::string table = fmt::format("{:<{}}  {:>9}  {:>8}  {:>8}  {:>8}  {:>10}  {:<13}  {:>6}\n",
                                  "photo", name_width, "pixel", "depth", "nearest", "farthest",
                                  "gap/sigma", "vote", "weight");
  for (const PhotoTestimony& photo : why.photos) {
    const Testimony& said = photo.said;
    const auto number = [](bool known, float value) {
      return known ? fmt::format("{:.4g}", value) : std::string("-");
    };
    const bool inside = said.vote != Vote::kOutside, has_depth = said.far > 0;
    table += fmt::format(
        "{:<{}}  {:>9}  {:>8}  {:>8}  {:>8}  {:>10}  {:<13}  {:>6}\n", photo.photo, name_width,
        inside ? fmt::format("{},{}", photo.x, photo.y) : "-", number(inside, said.z),
        number(has_depth, said.near), number(has_depth, said.far),
        has_depth && said.sigma_u > 0 ? fmt::format("{:+.1f}", said.gap_u / said.sigma_u) : "-",
        enum_to_string(said.vote), photo.weight);
  }
  return table;
}

}  // namespace vggtcd
