// SPDX-License-Identifier: Apache-2.0
// Runs another program to its end, its output in a log file; Ctrl-C ends it too.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace vggtcd {

// The file that PATH leads to. Throws Error{kUnavailable} ending in `remedy` if there is none.
std::string require_program(const std::string& program, const std::string& remedy);

// How a program ended. A signal is what the machine or its user did to it (memory, a batch system,
// a defect), never an answer about its input.
struct ProgramEnd {
  int status = 0;  // its exit status, if it was not ended by a signal
  int signal = 0;  // the signal, or 0

  bool succeeded() const { return status == 0 && signal == 0; }
  // "exit status 1", "it was ended by signal 9 (Killed), as when memory is short"
  std::string in_words() const;
};

// Runs arguments[0], looked up in PATH, and waits for it. Standard output and error are appended to
// `log`; standard input is empty; QT_QPA_PLATFORM=offscreen, so that programs with a user
// interface run without a display. Throws Error{kUnavailable} ending in `remedy` if there is no
// such program or it cannot be started, Error{kInterrupted} when an interrupt was requested, after
// ending it. The child also ends when this process does.
// `while_running` is called once the program has started, and then about twice a second.
ProgramEnd run_program(const std::vector<std::string>& arguments, const std::filesystem::path& log,
                       const std::string& remedy, const std::function<void()>& while_running = {});

}  // namespace vggtcd
