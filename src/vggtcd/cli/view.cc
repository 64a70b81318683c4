// SPDX-License-Identifier: Apache-2.0
// vggt-cd view: builds the report page of results that are there already.
#include <fmt/format.h>

#include <memory>

#include "vggtcd/cli/command.h"
#include "vggtcd/cli/standard_streams.h"
#include "vggtcd/io/quote.h"
#include "vggtcd/report/read_results.h"
#include "vggtcd/report/report_page.h"

namespace vggtcd::cli {

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
        const std::filesystem::path page = arguments->page.empty()
                                               ? results / "report.html"
                                               : std::filesystem::path(arguments->page);
        ReportSize size;
        {
          ProgressStage stage(progress, "report page");
          const ReportInput input = read_results(results);
          stage.advance(0.5);
          size = write_report(input, arguments->options, page);
        }
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
