// SPDX-License-Identifier: Apache-2.0
// vggt-cd synthesize: a generated bi-temporal scene with its truth.
#include <fmt/format.h>

#include "vggtcd/cli/command.h"
#include "vggtcd/cli/standard_streams.h"
#include "vggtcd/evaluation/synthetic/dataset.h"
#include "vggtcd/io/quote.h"

namespace vggtcd::cli {
namespace {

struct Arguments {
  std::string directory;
  bool list = false;
  SynthesizeOptions options;
};

void run(const Arguments& arguments, ProgressSink& progress) {
  if (arguments.list) {
    for (const std::string_view name : all_scene_names()) print_answer("{}\n", name);
    return;
  }
  if (arguments.directory.empty()) {
    throw_error(ErrorCode::kUsage, "OUT: expected a new directory to write to, found none");
  }
  synthesize(arguments.directory, arguments.options, progress);
  print_answer(
      "{}: before/ after/ (photos), t1.npz t2.npz joint.npz (predictions), truth.npz "
      "truth.json\n",
      escaped(arguments.directory));
}

}  // namespace

void add_synthesize(Program& program) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command =
      add_command(program, program.app, "synthesize",
                  "Write a generated scene at two times: photos, predictions as a reconstruction "
                  "network would "
                  "make them, and the truth.",
                  [arguments](ProgressSink& progress) { run(*arguments, progress); });
  command->add_option("OUT", arguments->directory, "new or empty directory");
  command->add_flag("--list", arguments->list, "print the names of the scenes and stop");
  SynthesizeOptions& options = arguments->options;
  for_each_field(options, [&](std::string_view name, auto& field, std::string_view help) {
    if constexpr (requires { std::remove_reference_t<decltype(field)>::fields; }) {
      add_fields(command, field, name == "render" ? "Rendering" : "Errors of the predictions");
    } else {
      add_field(command, name, field, help);
      command->get_option(flag_of(name))->group("Scene");
    }
  });
  command->footer(
      "What each file holds: docs/formats.md. How scenes, labels and errors are made, and why:\n"
      "docs/synthetic.md. The same options give the same bytes.");
}

}  // namespace vggtcd::cli
