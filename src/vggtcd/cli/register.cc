// SPDX-License-Identifier: Apache-2.0
// vggt-cd register: the alignment of two epochs alone.
#include <fmt/format.h>

#include <memory>

#include "vggtcd/cli/command.h"
#include "vggtcd/cli/epoch_arguments.h"
#include "vggtcd/cli/standard_streams.h"
#include "vggtcd/io/photo_source.h"
#include "vggtcd/io/quote.h"
#include "vggtcd/pipeline/detect.h"

namespace vggtcd::cli {

void add_register(Program& program) {
  struct Arguments {
    EpochArguments epochs;
    AlignmentOptions options;
    bool authors_layout = false;
  };
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = add_command(
      program, program.app, "register", "Align two epochs; no change detection.",
      [arguments](ProgressSink& progress) {
        for (const std::string& epoch : {arguments->epochs.before, arguments->epochs.after}) {
          if (!names_photos(epoch)) continue;
          throw_error(
              ErrorCode::kUsage,
              "expected two prediction files (.npz), found {}; photos are for detect, whose "
              "OUT/sim3.json has the alignment",
              quote(epoch));
        }
        arguments->epochs.require_out_apart();
        const auto [alignment, metric] =
            register_epochs(arguments->epochs.inputs(), arguments->options,
                            arguments->authors_layout, arguments->epochs.out, progress);
        print_plausibility(alignment);
        print_answer("{}\n{}/sim3.json has the similarity, scale {:.6g}.\n",
                     escaped(alignment.explanation), escaped(arguments->epochs.out),
                     alignment.t2_from_t1.scale);
        if (metric) print_answer("{}\n", escaped(metric_sentence(*metric)));
      });
  arguments->epochs.add_to(command);
  add_fields(command, arguments->options, "Alignment");
  command->add_flag("--authors-layout", arguments->authors_layout,
                    "Also write the files that the paper's own evaluator reads: coarse_sim3.npz, "
                    "fine_sim3.npz, pred_poses_t1.npy, pred_poses_t2.npy, timing.json.");
  command->footer(
      "Example:\n"
      "  vggt-cd register t1.npz t2.npz --joint joint.npz -o out\n\n"
      "out/sim3.json maps T1 into T2: x_T2 = scale * rotation * x_T1 + translation.");
}

}  // namespace vggtcd::cli
