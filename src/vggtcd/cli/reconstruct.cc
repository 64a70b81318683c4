// SPDX-License-Identifier: Apache-2.0
// vggt-cd reconstruct: photos of one place -> cameras and depth, as a prediction file.
#include <fmt/format.h>

#include <memory>

#include "vggtcd/cli/command.h"
#include "vggtcd/cli/standard_streams.h"
#include "vggtcd/core/timer.h"
#include "vggtcd/io/output_conflict.h"
#include "vggtcd/io/output_file.h"
#include "vggtcd/io/photo_source.h"
#include "vggtcd/io/quote.h"
#include "vggtcd/reconstruction/choose_reconstructor.h"
#include "vggtcd/vggt/batch_file.h"
#include "vggtcd/vggt/checkpoint.h"
#include "vggtcd/vggt/memory_plan.h"
#include "vggtcd/vggt/model.h"
#include "vggtcd/vggt/preprocess.h"

namespace vggtcd::cli {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  std::vector<fs::path> photos;
  fs::path output;
  std::string weights;
  PreprocessOptions preprocess;
  VggtOptions network;
};

ImageBatch load_input(const Arguments& arguments, ProgressSink& progress) {
  const bool npz = arguments.photos.size() == 1 && arguments.photos[0].extension() == ".npz";
  if (npz) return read_image_batch(arguments.photos[0]);
  std::vector<PhotoRef> photos;
  for (const fs::path& source : arguments.photos) {
    const std::vector<PhotoRef> found = find_photos(source, {}, progress);
    photos.insert(photos.end(), found.begin(), found.end());
  }
  return load_photos(photos, arguments.preprocess, progress);
}

void reconstruct(const Arguments& arguments, ProgressSink& progress) {
  std::vector<std::string> inputs = {find_weights(arguments.weights)};
  for (const fs::path& source : arguments.photos) inputs.push_back(source.string());
  require_file_apart(arguments.output, inputs);
  // What can be known to fail fails now, not after the network has run for an hour.
  { const OutputFile probe(arguments.output); }
  const fs::path weights = require_weights(arguments.weights);
  const VggtConfig config = read_checkpoint_config(weights);
  const Precision precision = resolve_precision(arguments.network.precision);
  const ImageBatch images = load_input(arguments, progress);
  const VggtRun run{.frames = images.frames,
                    .height = images.height,
                    .width = images.width,
                    .precision = precision,
                    .depth_head = arguments.network.depth_head,
                    .point_head = arguments.network.point_head};
  const MemoryPlan plan = plan_memory(config, run, available_memory_bytes());
  throw_unless_fits(plan);
  progress.notice(plan.summary());

  const Vggt network = [&] {
    const ProgressStage stage(progress, "weights");
    return Vggt::load(weights, arguments.network);
  }();
  const Prediction prediction = network.reconstruct(images, progress);
  {
    const ProgressStage stage(progress, "write");
    write_prediction(arguments.output, images, prediction);
  }
  print_answer("{}: {} frames of {} x {} px\n", escaped(arguments.output.string()), images.frames,
               images.width, images.height);
}

}  // namespace

void add_reconstruct(Program& program) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command =
      add_command(program, program.app, "reconstruct",
                  "Estimate cameras, depth and confidence from photos of one place.",
                  [arguments](ProgressSink& progress) { reconstruct(*arguments, progress); });
  command
      ->add_option("PHOTOS", arguments->photos,
                   "Folders, patterns, photos and videos, in order; or one .npz with images "
                   "(S,3,H,W) in [0,1].")
      ->required();
  command
      ->add_option("-o,--out,--output", arguments->output, "The prediction file to write (.npz).")
      ->required();
  command
      ->add_option("--weights", arguments->weights,
                   "VGGT's weights: .safetensors or .pt, as downloaded or converted. Otherwise "
                   "VGGTCD_WEIGHTS, then ~/.local/share/vggt-cd/model.safetensors.")
      ->type_name("FILE");
  add_fields(command, arguments->network, "Network");
  add_fields(command, arguments->preprocess, "Photos");
  command->footer(
      "Example:\n"
      "  vggt-cd reconstruct before/ -o t1.npz --weights model.safetensors\n\n"
      "The world is close to the first photo's camera, its scale the network's own. The keys are\n"
      "those of VGGT's demo: extrinsic (camera-from-world, OpenCV axes), intrinsic, depth,\n"
      "depth_conf, pose_enc, images; with --point-head also world_points, world_points_conf.\n"
      "Memory grows with the number of photos, time with its square; the need is told before\n"
      "the work starts.");
}

}  // namespace vggtcd::cli
