// SPDX-License-Identifier: Apache-2.0
// vggt-cd weights: what a weights file holds, and converting it.
#include <fmt/format.h>

#include <map>
#include <memory>

#include "vggtcd/cli/command.h"
#include "vggtcd/cli/standard_streams.h"
#include "vggtcd/io/output_conflict.h"
#include "vggtcd/io/quote.h"
#include "vggtcd/io/weight_file.h"
#include "vggtcd/vggt/checkpoint.h"
#include "vggtcd/vggt/network_tensors.h"

namespace vggtcd::cli {
namespace {

// The first few of a list that may be long.
void print_list(const char* title, const std::vector<std::string>& names) {
  constexpr size_t kShown = 8;
  if (names.empty()) return print_answer("{:<13}none\n", title);
  print_answer("{:<13}{} tensors\n", title, names.size());
  for (size_t i = 0; i < std::min(kShown, names.size()); ++i) {
    const std::string quoted = quote(names[i]);
    print_answer("               {}\n", quoted.substr(1, quoted.size() - 2));
  }
  if (names.size() > kShown) print_answer("               and {} more\n", names.size() - kShown);
}

void print_precision(const WeightFile& file) {
  std::map<std::string_view, int64_t> values;
  int64_t all = 0, bytes = 0;
  for (const TensorView& tensor : file.tensors) {
    values[dtype_name(tensor.dtype)] += tensor.numel();
    all += tensor.numel();
    bytes += static_cast<int64_t>(tensor.data.size());
  }
  print_answer("{:<13}{}, {:.2f} million values, {:.3f} GB\n", "tensors", file.tensors.size(),
               static_cast<double>(all) / 1e6, static_cast<double>(bytes) / 1e9);
  std::string text;
  for (const auto& [dtype, count] : values) {
    if (!text.empty()) text += ", ";
    const double share =
        100 * static_cast<double>(count) / static_cast<double>(std::max<int64_t>(all, 1));
    text += fmt::format("{} {:.4g} %", dtype, share);
  }
  print_answer("{:<13}{}\n", "precision", text);
}

void print_network(const CheckpointReport& report, bool has_config) {
  const NetworkSizes& s = report.sizes;
  print_answer(
      "{:<13}VGGT: {} frame and {} global blocks of width {}, patch embedder of {} blocks\n",
      "network", s.depth, s.depth, s.embed_dim, s.vit_depth);
  print_answer("{:<13}{}\n", "config",
               has_config ? "in the file" : "not in the file: heads and layers as in VGGT-1B");
  for (const CheckpointReport::Module& module : report.modules) {
    const std::string state = module.present == module.expected ? "complete"
                              : module.present == 0             ? "absent"
                                                                : "incomplete";
    print_answer("  {:<13}{}, {} of {} tensors, {:.2f} million values\n", module.name, state,
                 module.present, module.expected, static_cast<double>(module.values) / 1e6);
  }
  if (report.track_head_tensors > 0) {
    print_answer("  {:<13}{} tensors, not used by this program\n", "track_head",
                 report.track_head_tensors);
  }
  print_list("missing", report.missing);
  print_list("misshapen", report.misshapen);
  print_list("superfluous", report.superfluous);
}

// Cameras and depth need these; the point head is optional.
void throw_if_unusable(const CheckpointReport& report, const std::string& path) {
  for (const CheckpointReport::Module& module : report.modules) {
    if (module.present == module.expected || module.name == "point_head") continue;
    throw_error(ErrorCode::kWeights,
                "{}: not usable: {} has {} of {} tensors; download the file again", path,
                module.name, module.present, module.expected);
  }
}

void add_info(Program& program, CLI::App& parent) {
  const auto path = std::make_shared<std::string>();
  CLI::App* command = add_command(
      program, parent, "info", "Show what a weights file holds.", [path](ProgressSink&) {
        const WeightFile file = open_weight_file(*path);
        print_answer("{:<13}{}\n", "file", escaped(*path));
        print_answer("{:<13}{}\n", "format", weight_format_name(file.format));
        if (!file.removed_prefix.empty()) {
          print_answer("{:<13}{} before every name, left out\n", "prefix",
                       escaped(file.removed_prefix));
        }
        print_precision(file);
        const CheckpointReport report = inspect_checkpoint(file, *path);
        print_network(report, file.metadata.contains("config"));
        throw_if_unusable(report, *path);
      });
  command->add_option("FILE", *path, "A .safetensors or .pt file, recognised by its content.")
      ->required();
  command->footer(
      "Example:\n"
      "  vggt-cd weights info model.safetensors\n\n"
      "The status is 4 if the aggregator, the camera head or the depth head is not complete.");
}

void add_convert(Program& program, CLI::App& parent) {
  struct Arguments {
    std::string from, to;
    ConvertOptions options;
  };
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = add_command(
      program, parent, "convert", "Write a weights file as safetensors of another precision.",
      [arguments](ProgressSink& progress) {
        require_file_apart(arguments->to, {arguments->from});
        convert_weights(arguments->from, arguments->to, arguments->options, progress);
        print_answer("{}\n", escaped(arguments->to));
      });
  command->add_option("FILE", arguments->from, "A .safetensors or .pt file.")->required();
  command->add_option("-o,--out,--output", arguments->to, "The .safetensors file to write.")
      ->required();
  add_fields(command, arguments->options, "Conversion");
  command->footer(
      "Example:\n"
      "  vggt-cd weights convert model.pt -o model-bf16.safetensors --precision bf16\n\n"
      "bf16 halves the file and is what --precision bf16 computes with. Matrices and convolutions\n"
      "are converted; norms, biases and tokens are few and stay f32. The file is complete or\n"
      "not there at all.");
}

}  // namespace

void add_weights(Program& program) {
  CLI::App* parent = program.app.add_subcommand("weights", "Inspect and convert network weights.");
  parent->require_subcommand(1);
  add_info(program, *parent);
  add_convert(program, *parent);
}

}  // namespace vggtcd::cli
