// SPDX-License-Identifier: Apache-2.0
// The arguments that detect and register share: two epochs and what brings them together.
#include "vggtcd/cli/epoch_arguments.h"

#include <fmt/format.h>

#include "vggtcd/cli/standard_streams.h"
#include "vggtcd/core/number_text.h"
#include "vggtcd/io/output_conflict.h"

namespace vggtcd::cli {
namespace {

constexpr const char* kMetres = "Metres (one of the two)";

double metres_of(const std::string& text) {
  const auto metres = number_in<double>(text);
  if (!metres) {
    throw_error(ErrorCode::kUsage,
                "--known-distance: expected A B METRES with a number of metres, found \"{}\"",
                text);
  }
  return *metres;
}

}  // namespace

void EpochArguments::add_to(CLI::App* command) {
  command->add_option("BEFORE", before, "The before epoch, T1: a prediction file (.npz).")
      ->required();
  command->add_option("AFTER", after, "The after epoch, T2.")->required();
  command
      ->add_option("-o,--out,--output", out, "Directory for the results; it appears when complete.")
      ->type_name("DIRECTORY")
      ->required();
  command
      ->add_option("--joint", joint,
                   "Predictions of the joint pass (.npz): K keyframes of T1, then K of T2, with "
                   "keyframes_t1 and keyframes_t2.")
      ->type_name("FILE")
      ->group("How the epochs come together (predictions: exactly one)");
  command
      ->add_option("--initial-sim3", initial_sim3,
                   "A sim3.json with scale, rotation and translation: x_T2 = s R x_T1 + t.")
      ->type_name("FILE")
      ->group("How the epochs come together (predictions: exactly one)");
  command->add_flag("--aligned", aligned, "Both epochs are in one frame and scale already.")
      ->group("How the epochs come together (predictions: exactly one)");
  command
      ->add_option("--known-distance", known_distances,
                   "Two pixels and the distance in metres of what they show, measured on site: "
                   "all results are in metres then. A and B are X,Y,before/PHOTO or "
                   "X,Y,after/PHOTO, PHOTO a name or a number from 0; 0,0 is the top left pixel of "
                   "the photo as it was analysed (its size is in summary.json). "
                   "Give it again for every distance that is known: the scale is their "
                   "least-squares fit, and how they disagree its standard error.")
      ->type_name("A B METRES")
      ->type_size(3)
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll)
      ->group(kMetres);
  command
      ->add_option(
          "--reference", reference,
          "Where at least three cameras stood, in metres: a table with NAME X Y Z a line "
          "(or CSV), a COLMAP model, or a TUM file (its time stamps are numbers of AFTER's "
          "photos from 0). NAME is a photo, with before/ or after/ where both have it. All "
          "results are in metres and in the frame of the table then.")
      ->type_name("FILE")
      ->group(kMetres);
}

MetricInputs EpochArguments::metric() const {
  check(known_distances.size() % 3 == 0, "--known-distance: three values each");
  MetricInputs metric;
  for (size_t i = 0; i < known_distances.size(); i += 3) {
    metric.known_distances.push_back(
        {known_distances[i], known_distances[i + 1], metres_of(known_distances[i + 2])});
  }
  if (!reference.empty()) metric.reference = reference;
  metric.validate();
  return metric;
}

void print_plausibility(const Alignment& alignment) {
  const PlausibilityResult& plausibility = alignment.plausibility;
  if (plausibility.verdict == Plausibility::kBelievable) return;
  print_answer("Careful: {}.\n", plausibility.explanation);
}

void EpochArguments::require_out_apart(const std::string& weights) const {
  require_directory_apart(out, {before, after, joint, initial_sim3, reference, weights});
}

void EpochArguments::require_none() const {
  if (joint.empty() && initial_sim3.empty() && !aligned) return;
  throw_error(
      ErrorCode::kUsage,
      "--joint, --initial-sim3 and --aligned are for two prediction files, found photos ({}, {}); "
      "leave the option out",
      before, after);
}

EpochInputs EpochArguments::inputs() const {
  const int given = (joint.empty() ? 0 : 1) + (initial_sim3.empty() ? 0 : 1) + (aligned ? 1 : 0);
  if (given != 1) {
    throw_error(
        ErrorCode::kUsage,
        "expected exactly one of --joint FILE, --initial-sim3 FILE and --aligned, found {}: two "
        "reconstructions have nothing in common otherwise",
        given);
  }
  EpochInputs inputs;
  inputs.before = before;
  inputs.after = after;
  if (!joint.empty()) inputs.joint = joint;
  if (!initial_sim3.empty()) inputs.initial_sim3 = initial_sim3;
  inputs.aligned = aligned;
  inputs.metric = metric();
  return inputs;
}

}  // namespace vggtcd::cli
