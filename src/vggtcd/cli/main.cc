// SPDX-License-Identifier: Apache-2.0
// vggt-cd: dispatches to the subcommands and turns an Error into one line and an exit status.
#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <opencv2/core/utility.hpp>
#include <sstream>

#include "vggtcd/cli/command.h"
#include "vggtcd/cli/manual_page.h"
#include "vggtcd/cli/standard_streams.h"
#include "vggtcd/cli/terminal_progress.h"
#include "vggtcd/core/interrupt.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/core/version.h"
#include "vggtcd/io/failure.h"

namespace vggtcd::cli {
namespace {

int fail(ErrorCode code, std::string_view what) noexcept {
  tell("vggt-cd: ", what);
  return static_cast<int>(code);
}

// OpenBLAS, which comes with OpenCV and is not used, starts threads while it is loaded, each with
// 128 MB; where they cannot be had it ends the process or takes the memory that others need. It
// obeys a variable, so this runs before any library does: in the place of "_", which only shells
// care about.
char g_no_blas_threads[] = "OPENBLAS_NUM_THREADS=1";
constexpr std::string_view kBlasVariable = "OPENBLAS_NUM_THREADS";

void forbid_blas_threads(int, char**, char** environment) {
  char** place = nullptr;
  for (char** entry = environment; *entry != nullptr; ++entry) {
    const std::string_view variable(*entry);
    if (variable.starts_with(kBlasVariable)) return;  // the user knows better
    if (variable.starts_with("_=")) place = entry;
  }
  if (place != nullptr) *place = g_no_blas_threads;
}
[[gnu::section(".preinit_array"),
  gnu::used]] void (*const g_before_libraries)(int, char**, char**) = forbid_blas_threads;

// An exception in a destructor, OpenCV's where memory is short: no way back, but still one line.
[[noreturn]] void on_terminate() {
  int status = static_cast<int>(ErrorCode::kMemory);
  try {
    const Error error = failure_in_flight();
    status = fail(error.code(), error.what());
  } catch (...) {
    fail(ErrorCode::kMemory, kOutOfMemory);
  }
  std::_Exit(status);
}

// What the surroundings may do to a process is an error that is told, not the end of it.
void prepare_process() {
  open_closed_streams();
  std::set_terminate(on_terminate);
  // It was for us, not for programs that we start.
  const char* blas = std::getenv(kBlasVariable.data());
  if (blas == g_no_blas_threads + kBlasVariable.size() + 1) unsetenv(kBlasVariable.data());
  // The write fails instead, with a reason, and what was begun is cleaned up: a reader that is
  // gone, a limit on the size of files (ulimit -f).
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  // Freed arrays go back to the system at once: glibc would come to keep those below 32 MiB, which
  // adds up to a tenth of the peak.
  mallopt(M_MMAP_THRESHOLD, 4 << 20);
  reserve_memory_for_failures();
}

// The threads of this program are those of core/parallel.h.
void start_work_threads(int wanted, ProgressSink& progress) {
  if (wanted > 0) set_num_threads(wanted);
  cv::setNumThreads(1);
  const int asked = num_threads();
  const int given = start_threads();
  if (given == asked) return;
  progress.notice(fmt::format(
      "the system does not give {} threads (a limit on processes or on memory); going on with {}",
      asked, given));
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
    if (error.get_exit_code() == 0) {  // --help, --version
      std::ostringstream text;
      program.app.exit(error, text, text);
      write_answer(text.str());
      finish_answer();
      return 0;
    }
    return fail(ErrorCode::kUsage, error.what() + std::string(" (try --help)"));
  }
  install_interrupt_handler();
  const std::unique_ptr<ProgressSink> progress = make_progress(program.common.progress);
  start_work_threads(program.common.threads, *progress);
  try {
    program.action(*progress);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kUsage) throw;
    return fail(error.code(), with_flag(error.what(), *program.app.get_subcommands().front()));
  }
  finish_answer();
  return 0;
}

int run_or_fail(int argc, char** argv) noexcept try {
  try {
    return run(argc, argv);
  } catch (...) {
    const Error error = failure_in_flight();
    return fail(error.code(), error.what());
  }
} catch (...) {  // not even memory for the sentence
  return fail(ErrorCode::kMemory, kOutOfMemory);
}

}  // namespace
}  // namespace vggtcd::cli

int main(int argc, char** argv) {
  vggtcd::cli::prepare_process();
  const int status = vggtcd::cli::run_or_fail(argc, argv);
  // Without the shut-down of libraries: where memory is short, OpenBLAS (of OpenCV) waits there for
  // ever for a thread that waits for memory.
  std::fflush(nullptr);
  std::_Exit(status);
}
