// SPDX-License-Identifier: Apache-2.0
// The arguments that detect and register share: two epochs, what brings them together, and what is
// known in metres.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include "vggtcd/pipeline/detect.h"

namespace vggtcd::cli {

struct EpochArguments {
  std::string before, after, joint, initial_sim3, reference, out;
  std::vector<std::string> known_distances;  // A, B, METRES each
  bool aligned = false;

  void add_to(CLI::App* command);
  // Throws Error{kUsage} unless exactly one of --joint, --initial-sim3 and --aligned was given.
  EpochInputs inputs() const;
  // Throws Error{kUsage}.
  MetricInputs metric() const;
  // Before any work: throws Error{kOutput} if OUT stands on one of the inputs
  // (io/output_conflict.h). `weights`: of the network, or empty.
  void require_out_apart(const std::string& weights = "") const;
  // For photos, which need none of them: throws Error{kUsage} if one was given.
  void require_none() const;
};

// A line for the terminal where something speaks against the alignment as a whole.
void print_plausibility(const Alignment& alignment);

}  // namespace vggtcd::cli
