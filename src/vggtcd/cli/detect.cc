// SPDX-License-Identifier: Apache-2.0
// vggt-cd detect: two reconstructed epochs in, an aligned 3D change map out.
#include "vggtcd/pipeline/detect.h"

#include <fmt/format.h>

#include <memory>

#include "vggtcd/cli/command.h"
#include "vggtcd/cli/epoch_arguments.h"

namespace vggtcd::cli {
namespace {

double percent(int64_t part, int64_t whole) {
  return whole > 0 ? 100.0 * static_cast<double>(part) / static_cast<double>(whole) : 0.0;
}

}  // namespace

void add_detect(Program& program) {
  struct Arguments {
    EpochArguments epochs;
    DetectOptions options;
  };
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = add_command(
      program, program.app, "detect", "Align two epochs and find what changed between them in 3D.",
      [arguments](ProgressSink& progress) {
        const DetectOutcome outcome =
            detect(arguments->epochs.inputs(), arguments->options, arguments->epochs.out, progress);
        fmt::print("{}\n", outcome.alignment.explanation);
        fmt::print("Changed: {:.1f} % of {} points before, {:.1f} % of {} points after.\n",
                   percent(outcome.changed_t1, outcome.points_t1), outcome.points_t1,
                   percent(outcome.changed_t2, outcome.points_t2), outcome.points_t2);
        fmt::print(
            "Look at {0}/report.html, {0}/overlays, {0}/before_aligned.ply and {0}/after.ply.\n",
            arguments->epochs.out);
      });
  arguments->epochs.add_to(command);
  add_fields(command, arguments->options.alignment, "Alignment");
  add_fields(command, arguments->options.change, "Change");
  add_field(command, "overlays", arguments->options.overlays,
            "Write overlays/: each photo beside its heat map.");
  add_field(command, "page", arguments->options.page, "Write report.html: everything in one page.");
  add_fields(command, arguments->options.report, "Page");
  command->footer(
      "Example:\n"
      "  vggt-cd detect t1.npz t2.npz --joint joint.npz -o out\n\n"
      "Reads the .npz files that VGGT, VGGT-Omega, MapAnything and Depth Anything 3 save. Writes "
      "before_aligned.ply and after.ply\n(scalar fields change_distance, changed, confidence), "
      "overlays/, change.npz, sim3.json, summary.json, cameras_*.tum and\na COLMAP model; "
      "docs/formats.md describes them all.");
}

}  // namespace vggtcd::cli
