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

// Runs arguments[0], looked up in PATH, and waits for it. Standard output and error are appended to
// `log`; standard input is empty; QT_QPA_PLATFORM=offscreen, so that programs with a user
// interface run without a display. Returns the exit status, or 128 + signal. Throws
// Error{kUnavailable} ending in `remedy` if there is no such program, Error{kInterrupted} after
// ending it when an interrupt was requested. The child also ends when this process does.
// `while_running` is called once the program has started, and then about twice a second.
int run_program(const std::vector<std::string>& arguments, const std::filesystem::path& log,
                const std::string& remedy, const std::function<void()>& while_running = {});

}  // namespace vggtcd
