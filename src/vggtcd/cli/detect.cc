// SPDX-License-Identifier: Apache-2.0
// vggt-cd detect: two reconstructed epochs in, an aligned 3D change map out.
#include "vggtcd/pipeline/detect.h"

#include <fmt/format.h>

#include <memory>

#include "vggtcd/cli/command.h"
#include "vggtcd/cli/epoch_arguments.h"
#include "vggtcd/cli/standard_streams.h"
#include "vggtcd/io/quote.h"
#include "vggtcd/pipeline/photo_stages.h"

namespace vggtcd::cli {
namespace {

double percent(int64_t part, int64_t whole) {
  return whole > 0 ? 100.0 * static_cast<double>(part) / static_cast<double>(whole) : 0.0;
}

PixelExplanation with_escaped_names(PixelExplanation why) {
  why.photo = escaped(why.photo);
  for (PhotoTestimony& photo : why.photos) photo.photo = escaped(photo.photo);
  return why;
}

}  // namespace

void add_detect(Program& program) {
  struct Arguments {
    EpochArguments epochs;
    PhotoInputs photos;
    DetectOptions options;
    bool dry_run = false;
  };
  const auto arguments = std::make_shared<Arguments>();
  const auto run = [arguments](ProgressSink& progress) {
    const EpochArguments& epochs = arguments->epochs;
    EpochInputs inputs;
    ReconstructedPhotos photos;
    epochs.require_out_apart(find_weights(arguments->photos.reconstruction.weights));
    if (names_photos(epochs.before) || names_photos(epochs.after)) {
      arguments->options.validate();
      const MetricInputs metric = epochs.metric();
      arguments->photos.before = epochs.before;
      arguments->photos.after = epochs.after;
      epochs.require_none();
      if (arguments->dry_run) {
        print_answer("{}",
                     describe_plan(arguments->photos, arguments->options, epochs.out, progress));
        return;
      }
      photos = reconstruct_photos(arguments->photos, arguments->options, epochs.out, progress);
      print_answer("{}\n", escaped(photos.explanation));
      inputs = photos.inputs;
      inputs.metric = metric;
    } else {
      inputs = epochs.inputs();
      if (arguments->dry_run) {
        print_answer("{}", describe_plan(inputs, arguments->options, epochs.out));
        return;
      }
    }
    const DetectOutcome outcome = detect(inputs, arguments->options, epochs.out, progress);
    print_plausibility(outcome.alignment);
    print_answer("{}\n", escaped(outcome.alignment.explanation));
    print_answer("Changed: {:.1f} % of {} points before, {:.1f} % of {} points after.\n",
                 percent(outcome.changed_t1, outcome.points_t1), outcome.points_t1,
                 percent(outcome.changed_t2, outcome.points_t2), outcome.points_t2);
    if (outcome.unobserved_t1 + outcome.unobserved_t2 > 0) {
      print_answer("Not seen by the other epoch: {:.1f} % before, {:.1f} % after.\n",
                   percent(outcome.unobserved_t1, outcome.points_t1),
                   percent(outcome.unobserved_t2, outcome.points_t2));
    }
    print_answer("Things: {} removed, {} added, {} moved.\n", outcome.removed, outcome.added,
                 outcome.moved);
    if (outcome.explanation) {
      const PixelExplanation why = with_escaped_names(*outcome.explanation);
      print_answer("{}\n{}", explanation_sentence(why, outcome.metric ? "m" : "scene units"),
                   explanation_table(why));
    }
    print_answer("{}\n", outcome.metric ? escaped(metric_sentence(*outcome.metric))
                                        : "Lengths are in scene units; --known-distance or "
                                          "--reference gives metres.");
    const std::string out = escaped(epochs.out);
    print_answer("Look at {}{}{}/before_aligned.ply and {}/after.ply.\n",
                 arguments->options.page ? out + "/report.html, " : "",
                 arguments->options.overlays ? out + "/overlays, " : "", out, out);
  };
  CLI::App* command =
      add_command(program, program.app, "detect",
                  "Find what changed in 3D between two sets of photos of one place.", run);
  arguments->epochs.add_to(command);
  command->get_option("BEFORE")->description(
      "The before epoch, T1: photos (a folder, a pattern or a video) or predictions (.npz).");
  command->get_option("AFTER")->description("The after epoch, T2: the same.");
  command
      ->add_option("--frames", arguments->photos.frames,
                   "At most this many photos per epoch, evenly spread; 0 takes all, and 40 of a "
                   "video (the sharpest of each stretch).")
      ->capture_default_str()
      ->check(CLI::Range(0, 10000))
      ->group("Photos");
  add_fields(command, arguments->photos.reconstruction, "Photos");
  command
      ->add_flag("--dry-run", arguments->dry_run,
                 "Print the plan (frames, sizes, memory, time) and do nothing. Photos are read, so "
                 "that what is wrong with them is said now.")
      ->group("General");
  add_fields(command, arguments->options.alignment, "Alignment");
  add_field_of(command, arguments->options, "change_method", "Change");
  add_fields(command, arguments->options.change, "Change");
  add_fields(command, arguments->options.free_space, "Change");
  add_fields(command, arguments->options.instances, "Instances");
  command
      ->add_option("--explain", arguments->options.explain,
                   "Tell which photos of the other epoch voted how for one pixel, and write "
                   "explain.json: X,Y,before/PHOTO or X,Y,after/PHOTO. PHOTO is its name or its "
                   "number from 0; 0,0 is the top left pixel of the photo as it was analysed (its "
                   "size is in summary.json; the overlays may be enlarged).")
      ->group("Change");
  add_field_of(command, arguments->options, "overlays", "Page");
  add_field_of(command, arguments->options, "page", "Page");
  add_fields(command, arguments->options.report, "Page");
  command->footer(
      "Examples:\n"
      "  vggt-cd detect before/ after/ -o out\n"
      "  vggt-cd detect before.mp4 'after/*.jpg' --frames 30 -o out\n"
      "  vggt-cd detect t1.npz after/ -o out\n"
      "  vggt-cd detect t1.npz t2.npz --joint joint.npz -o out\n"
      "  vggt-cd detect t1.npz t2.npz --joint joint.npz --explain 120,88,after/3 -o out\n"
      "  vggt-cd detect before/ after/ --known-distance 87,310,after/door.jpg "
      "160,308,after/door.jpg 0.88 -o out\n"
      "  vggt-cd detect before/ after/ --reference surveyed.csv -o out\n\n"
      "Photos: each side a folder, a pattern or a video; or one side a prediction file that holds "
      "its images. Without network\nweights they are reconstructed by COLMAP and plane-sweep "
      "depth, a fallback that refuses what it cannot place. Finished\nstages are kept in "
      "OUT/.stages: a job that was interrupted goes on, one that is repeated starts at the "
      "alignment.\n\n"
      "Reads the .npz files that VGGT, VGGT-Omega, MapAnything and Depth Anything 3 save. Writes "
      "report.html (everything in one\npage), before_aligned.ply and after.ply (scalar fields), "
      "overlays/, changes.json and changes.csv (what changed, as things), change.npz,\nsim3.json, "
      "summary.json, cameras_*.tum and a COLMAP model; docs/formats.md describes them all.");
}

}  // namespace vggtcd::cli
