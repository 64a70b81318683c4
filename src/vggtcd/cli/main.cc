// SPDX-License-Identifier: Apache-2.0
// vggt-cd: dispatches to the subcommands and turns an Error into one line and an exit status.
#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <new>

#include "vggtcd/cli/command.h"
#include "vggtcd/cli/manual_page.h"
#include "vggtcd/cli/terminal_progress.h"
#include "vggtcd/core/interrupt.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/core/version.h"

namespace vggtcd::cli {
namespace {

int fail(ErrorCode code, std::string_view what) {
  fmt::print(stderr, "vggt-cd: {}\n", what);
  return static_cast<int>(code);
}

// The library names options by their fields ("min_votes: expected ..."); users know the flag.
std::string with_flag(const std::string& what, const CLI::App& command) {
  const size_t colon = what.find(':');
  if (colon == std::string::npos) return what;
  const std::string flag = flag_of(what.substr(0, colon));
  return command.get_option_no_throw(flag) != nullptr ? flag + what.substr(colon) : what;
}

int run(int argc, char** argv) {
  Program program;
  program.app.name("vggt-cd");
  program.app.formatter(std::make_shared<ManualPage>());
  program.app.description("Tells what changed in 3D between two sets of photos of one place.");
  program.app.set_version_flag("--version", std::string("vggt-cd ") + kVersion);
  program.app.require_subcommand(1);
  program.app.footer(
      "'vggt-cd COMMAND --help' explains a command. Exit statuses: docs/formats.md.");
  add_detect(program);
  add_register(program);
  add_view(program);
  add_reconstruct(program);
  add_weights(program);
  add_synthesize(program);
  add_benchmark(program);
  add_evaluate(program);
  const auto is_command = [&](const std::string& name) {
    return std::ranges::any_of(program.app.get_subcommands([](CLI::App*) { return true; }),
                               [&](CLI::App* command) { return command->get_name() == name; });
  };
  if (argc > 1 && argv[1][0] != '-' && !is_command(argv[1])) {
    return fail(ErrorCode::kUsage,
                fmt::format("expected a command, found {} (try --help)", argv[1]));
  }
  try {
    program.app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return program.app.exit(error);  // --help, --version
    return fail(ErrorCode::kUsage, error.what() + std::string(" (try --help)"));
  }
  if (program.common.threads > 0) set_num_threads(program.common.threads);
  install_interrupt_handler();
  const std::unique_ptr<ProgressSink> progress = make_progress(program.common.progress);
  try {
    program.action(*progress);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kUsage) throw;
    return fail(error.code(), with_flag(error.what(), *program.app.get_subcommands().front()));
  }
  return 0;
}

}  // namespace
}  // namespace vggtcd::cli

int main(int argc, char** argv) {
  // Freed arrays go back to the system at once: glibc would come to keep those below 32 MiB, which
  // adds up to a tenth of the peak.
  mallopt(M_MMAP_THRESHOLD, 4 << 20);
  // A limit on the size of files (ulimit -f) is a failed write with a reason, not the end.
  std::signal(SIGXFSZ, SIG_IGN);
  using vggtcd::Error;
  using vggtcd::ErrorCode;
  try {
    return vggtcd::cli::run(argc, argv);
  } catch (const Error& error) {
    return vggtcd::cli::fail(error.code(), error.what());
  } catch (const std::bad_alloc&) {
    return vggtcd::cli::fail(ErrorCode::kMemory, "out of memory; use fewer or smaller photos");
  } catch (const std::exception& error) {
    return vggtcd::cli::fail(ErrorCode::kInternal,
                             fmt::format("internal error: {}; please report it", error.what()));
  }
}
