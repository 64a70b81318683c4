// SPDX-License-Identifier: Apache-2.0
// vggt-cd benchmark: methods against known truth.
#include "vggtcd/evaluation/benchmark.h"

#include <fmt/format.h>

#include "vggtcd/cli/command.h"
#include "vggtcd/evaluation/benchmark_report.h"

namespace vggtcd::cli {
namespace {

struct Arguments {
  std::string suite = "synthetic";
  std::string data, predictions, out = "benchmark";
  BenchmarkOptions options;
};

void run(const Arguments& arguments, ProgressSink& progress) {
  std::vector<SceneOutcome> scenes;
  if (arguments.suite == "synthetic") {
    scenes = run_synthetic_suite(arguments.out, arguments.options, progress);
  } else {
    if (arguments.data.empty() || arguments.predictions.empty()) {
      throw_error(ErrorCode::kUsage,
                  "--suite wat: expected --data WAT_ROOT and --predictions DIR, found {}",
                  arguments.data.empty() ? "no --data" : "no --predictions");
    }
    scenes = run_wat_suite(arguments.out, arguments.data, arguments.predictions, arguments.options,
                           progress);
  }
  fmt::print("{}", report_markdown({arguments.suite, arguments.options, scenes}));
}

}  // namespace

void add_benchmark(Program& program) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = add_command(
      program, program.app, "benchmark",
      "Compares registration and change detection methods on scenes with known truth. Finished "
      "scenes are kept in OUT and not computed again.",
      [arguments](ProgressSink& progress) { run(*arguments, progress); });
  command
      ->add_option("--suite", arguments->suite,
                   "synthetic: generated scenes; wat: the WAT benchmark's folders")
      ->check(CLI::IsMember({"synthetic", "wat"}))
      ->capture_default_str();
  command->add_option("--data", arguments->data,
                      "wat: directory with SCENE/images and SCENE/sparse/0");
  command->add_option("--predictions", arguments->predictions,
                      "wat: directory with SCENE/t1.npz, t2.npz and joint.npz");
  command
      ->add_option("-o,--out", arguments->out, "directory for the report and for finished scenes")
      ->capture_default_str();
  add_fields(command, arguments->options, "Suite");
  command->footer(
      "Writes OUT/benchmark.{md,csv,json}, ablation.{csv,svg}, change.csv and trajectories.svg, "
      "and\n"
      "prints the tables. The protocol, the rivals and what the numbers mean: docs/benchmark.md.");
}

}  // namespace vggtcd::cli
