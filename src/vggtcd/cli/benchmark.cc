// SPDX-License-Identifier: Apache-2.0
// vggt-cd benchmark: methods against known truth.
#include "vggtcd/evaluation/benchmark.h"

#include <fmt/format.h>

#include <algorithm>

#include "vggtcd/cli/command.h"
#include "vggtcd/cli/standard_streams.h"
#include "vggtcd/evaluation/benchmark_report.h"
#include "vggtcd/evaluation/wat.h"
#include "vggtcd/io/file_system.h"
#include "vggtcd/io/output_conflict.h"
#include "vggtcd/io/photo_source.h"
#include "vggtcd/pipeline/predict_epochs.h"

namespace vggtcd::cli {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  std::string suite = "synthetic";
  std::string data, predictions, weights, out = "benchmark";
  int max_photos = 0;
  Precision precision = Precision::kAuto;
  BenchmarkOptions options;
};

std::vector<fs::path> thinned(const std::vector<fs::path>& photos, int max_photos) {
  if (max_photos == 0) return photos;
  std::vector<fs::path> kept;
  for (const int k : evenly_spaced(static_cast<int>(photos.size()), max_photos)) {
    kept.push_back(photos[static_cast<size_t>(k)]);
  }
  return kept;
}

// The joint passes of a scene: that of the tables first, then those of the ablation.
std::vector<JointPass> joint_passes(const BenchmarkOptions& options, size_t fewer_photos) {
  std::vector<JointPass> joints = {{options.keyframes, "joint.npz"}};
  if (!options.ablation) return joints;
  for (const int keyframes : kAblationKeyframes) {
    if (keyframes == options.keyframes) continue;
    if (static_cast<size_t>(keyframes) >= fewer_photos) continue;  // the same as all
    joints.push_back({keyframes, wat_joint_name(keyframes)});
  }
  return joints;
}

void predict_scene(const Arguments& arguments, const fs::path& directory, const std::string& scene,
                   ProgressSink& progress) {
  const WatPhotos found = list_wat_photos(fs::path(arguments.data) / scene);
  const PhotoPaths photos{thinned(found.before, arguments.max_photos),
                          thinned(found.after, arguments.max_photos)};
  VggtOptions network;
  network.precision = arguments.precision;
  const size_t fewer = std::min(photos.before.size(), photos.after.size());
  predict_epochs(photos, arguments.weights, network, joint_passes(arguments.options, fewer),
                 directory / scene, progress);
}

WatPredictions wat_predictions(const Arguments& arguments, ProgressSink& progress) {
  if (!arguments.predictions.empty()) return {arguments.predictions, "", {}};
  const fs::path directory = fs::path(arguments.out) / "predictions";
  return {
      directory,
      fmt::format("{}; at most {} photos; precision {}", absolute_path(arguments.weights).string(),
                  arguments.max_photos, enum_to_string(arguments.precision)),
      [&arguments, directory, &progress](const std::string& scene) {
        predict_scene(arguments, directory, scene, progress);
      }};
}

void run(const Arguments& arguments, ProgressSink& progress) {
  require_directory_apart(arguments.out,
                          {arguments.data, arguments.predictions, arguments.weights});
  std::vector<SceneOutcome> scenes;
  if (arguments.suite == "synthetic") {
    scenes = run_synthetic_suite(arguments.out, arguments.options, progress);
  } else {
    if (arguments.data.empty()) {
      throw_error(ErrorCode::kUsage, "--suite wat: expected --data WAT_ROOT, found none");
    }
    if (arguments.predictions.empty() == arguments.weights.empty()) {
      throw_error(ErrorCode::kUsage,
                  "--suite wat: expected one of --predictions DIR and --weights FILE, found {}",
                  arguments.weights.empty() ? "none" : "both");
    }
    scenes = run_wat_suite(arguments.out, arguments.data, wat_predictions(arguments, progress),
                           arguments.options, progress);
  }
  print_answer("{}", report_markdown({arguments.suite, arguments.options, scenes}));
}

}  // namespace

void add_benchmark(Program& program) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = add_command(
      program, program.app, "benchmark",
      "Compare registration and change detection methods on scenes with known truth. Finished "
      "scenes are kept in OUT and not computed again.",
      [arguments](ProgressSink& progress) { run(*arguments, progress); });
  command
      ->add_option("--suite", arguments->suite,
                   "synthetic: generated scenes; wat: the WAT benchmark's folders")
      ->check(CLI::IsMember({"synthetic", "wat"}))
      ->capture_default_str();
  command
      ->add_option("-o,--out,--output", arguments->out,
                   "directory for the report and for finished scenes")
      ->capture_default_str();
  add_fields(command, arguments->options, "Suite");
  command->add_option("--data", arguments->data, "directory with SCENE/images and SCENE/sparse/0")
      ->group("WAT");
  command
      ->add_option("--predictions", arguments->predictions,
                   "directory with SCENE/t1.npz, t2.npz and joint.npz")
      ->group("WAT");
  command
      ->add_option("--weights", arguments->weights,
                   "VGGT's weights: predictions are made from the photos and kept in "
                   "OUT/predictions")
      ->group("WAT");
  command
      ->add_option("--max-photos", arguments->max_photos,
                   "with --weights: at most this many photos per sequence, evenly spread; 0: all")
      ->check(CLI::Range(0, 10000))
      ->capture_default_str()
      ->group("WAT");
  add_field(command, "precision", arguments->precision,
            fmt::format("With --weights: {}", kPrecisionHelp));
  command->get_option("--precision")->group("WAT");
  command->footer(
      "Writes OUT/benchmark.{md,csv,json}, ablation.{csv,svg}, change.csv, instances.csv and\n"
      "trajectories.svg, and prints the tables. The protocol, the rivals and what the numbers "
      "mean:\n"
      "docs/benchmark.md.\n\n"
      "Examples:\n"
      "  vggt-cd benchmark -o out\n"
      "  vggt-cd benchmark -o out --seeds 201-203 --no-ablation\n"
      "  vggt-cd benchmark --suite wat --data WAT --weights model.safetensors -o out");
}

}  // namespace vggtcd::cli
