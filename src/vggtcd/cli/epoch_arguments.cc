// SPDX-License-Identifier: Apache-2.0
// The arguments that detect and register share: two epochs and what brings them together.
#include "vggtcd/cli/epoch_arguments.h"

#include <fmt/format.h>

namespace vggtcd::cli {

void EpochArguments::add_to(CLI::App* command) {
  command
      ->add_option("BEFORE", before,
                   "The before epoch, T1: predictions (.npz); for detect also photos.")
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
}

void print_plausibility(const Alignment& alignment) {
  const PlausibilityResult& plausibility = alignment.plausibility;
  if (plausibility.verdict == Plausibility::kBelievable) return;
  fmt::print("Careful: {}.\n", plausibility.explanation);
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
  return inputs;
}

}  // namespace vggtcd::cli
