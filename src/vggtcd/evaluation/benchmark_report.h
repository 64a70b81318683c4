// SPDX-License-Identifier: Apache-2.0
// The benchmark's report: benchmark.md, benchmark.csv, ablation.csv, change.csv, instances.csv,
// benchmark.json and plots (docs/formats.md).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "vggtcd/evaluation/benchmark.h"

namespace vggtcd {

struct SuiteReport {
  std::string suite;  // "synthetic" or "wat"
  BenchmarkOptions options;
  std::vector<SceneOutcome> scenes;
};

std::string report_markdown(const SuiteReport& report);
std::string registration_csv(const SuiteReport& report);
std::string ablation_csv(const SuiteReport& report);
// Predicted (red) and true (green) cameras from above, a row per method, a column per scene.
std::string trajectories_svg(const SuiteReport& report);
// ATE over the number of keyframes, coarse and with the fine stage, mean of all scenes.
std::string ablation_svg(const SuiteReport& report);

// Makes the directory; throws Error{kOutput} if reports could not be written there later
// (io/output_directory.h).
void claim_report(const std::filesystem::path& directory);

// Writes all of them. Throws Error{kOutput}.
void write_report(const std::filesystem::path& directory, const SuiteReport& report);

}  // namespace vggtcd
