// SPDX-License-Identifier: Apache-2.0
// vggt-cd view: builds the report page of results that are there already.
#include <fmt/format.h>

#include <memory>
#include <optional>

#include "vggtcd/cli/command.h"
#include "vggtcd/cli/standard_streams.h"
#include "vggtcd/io/file_system.h"
#include "vggtcd/io/output_conflict.h"
#include "vggtcd/io/output_directory.h"
#include "vggtcd/io/output_path.h"
#include "vggtcd/io/quote.h"
#include "vggtcd/report/read_results.h"
#include "vggtcd/report/report_page.h"

namespace vggtcd::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPage = "report.html";

ReportSize write_page(const fs::path& results, const fs::path& page, const ReportOptions& options,
                      ProgressSink& progress) {
  // The page of the results themselves is one of them: it is listed, and no other takes its place.
  const bool own = same_file(page.has_parent_path() ? page.parent_path() : ".", results) &&
                   page.filename() == kPage && exists_at(results / ResultList::kFile);
  std::optional<OutputDirectory> directory;
  if (own) {
    directory.emplace(results, OutputContents{kResultsKind, {kPage}, true});
  } else {
    require_no_result(page, results);
  }
  ProgressStage stage(progress, "report page");
  const ReportInput input = read_results(results);
  stage.advance(0.5);
  const ReportSize size = write_report(input, options, own ? *directory / kPage : page);
  if (own) directory->commit();
  return size;
}

}  // namespace

void add_view(Program& program) {
  struct Arguments {
    std::string results;
    std::string page;
    ReportOptions options;
  };
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = add_command(
      program, program.app, "view", "Build the report page of results that are there already.",
      [arguments](ProgressSink& progress) {
        arguments->options.validate();
        const std::filesystem::path results = arguments->results;
        const std::filesystem::path page =
            arguments->page.empty() ? results / kPage : std::filesystem::path(arguments->page);
        const ReportSize size = write_page(results, page, arguments->options, progress);
        print_answer("{}: {:.1f} MB, {} of {} points.\n", escaped(page.string()),
                     static_cast<double>(size.bytes) * 1e-6, size.points_shown, size.points);
      });
  command->add_option("results", arguments->results, "Directory that vggt-cd detect wrote")
      ->required();
  command->add_option("-o,--out,--output", arguments->page,
                      "The page to write; RESULTS/report.html if not given");
  add_fields(command, arguments->options, "Page");
  command->footer(
      "Example:\n"
      "  vggt-cd view out --max-points 500000 -o small.html\n\n"
      "The page is one HTML file that opens from disk and needs no network: both epochs in 3D, "
      "every photo with "
      "its heat map,\nand the numbers of summary.json. Needs a browser with WebGL 2; without, "
      "photos and numbers "
      "remain.");
}

}  // namespace vggtcd::cli
