// SPDX-License-Identifier: Apache-2.0
// Runs another program to its end: fork, exec, and a wait that looks at the interrupt flag.
#include "vggtcd/reconstruction/child_process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <thread>

#include "vggtcd/core/error.h"
#include "vggtcd/core/interrupt.h"
#include "vggtcd/io/file_system.h"

namespace vggtcd {
namespace {

constexpr int kNotStarted = 127;  // as shells say it

std::string find_in_path(const std::string& program) {
  const char* path = std::getenv("PATH");
  std::stringstream folders(path ? path : "/usr/bin:/bin");
  for (std::string folder; std::getline(folders, folder, ':');) {
    const std::string file = (folder.empty() ? "." : folder) + "/" + program;
    if (access(file.c_str(), X_OK) == 0 && is_file(file)) return file;
  }
  return {};
}

std::vector<std::string> offscreen_environment() {
  std::vector<std::string> variables;
  for (char** entry = environ; *entry; ++entry) {
    if (std::string_view(*entry).rfind("QT_QPA_PLATFORM=", 0) != 0) variables.emplace_back(*entry);
  }
  variables.emplace_back("QT_QPA_PLATFORM=offscreen");
  return variables;
}

std::vector<char*> pointers(const std::vector<std::string>& texts) {
  std::vector<char*> out;
  for (const std::string& text : texts) out.push_back(const_cast<char*>(text.c_str()));
  out.push_back(nullptr);
  return out;
}

// Between fork and exec: only what is safe in the child of a process with threads.
[[noreturn]] void become(const char* file, char* const* arguments, char* const* environment,
                         int log, pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(kNotStarted);
  const int nothing = open("/dev/null", O_RDONLY);
  dup2(nothing, STDIN_FILENO);
  dup2(log, STDOUT_FILENO);
  dup2(log, STDERR_FILENO);
  signal(SIGINT, SIG_DFL);
  signal(SIGTERM, SIG_DFL);
  signal(SIGPIPE, SIG_DFL);
  signal(SIGXFSZ, SIG_DFL);
  execve(file, arguments, environment);
  _exit(kNotStarted);
}

}  // namespace

std::string ProgramEnd::in_words() const {
  if (signal == 0 && status <= 128) return fmt::format("exit status {}", status);
  if (signal == 0) {
    return fmt::format("exit status {} (of a script: signal {}, {})", status, status - 128,
                       strsignal(status - 128));
  }
  std::string words = fmt::format("it was ended by signal {} ({})", signal, strsignal(signal));
  if (signal == SIGKILL) words += ", as when memory is short or a batch system's time is over";
  if (signal == SIGXFSZ) words += ", for a file became larger than is allowed (ulimit -f)";
  return words;
}

std::string require_program(const std::string& program, const std::string& remedy) {
  std::string file = find_in_path(program);
  if (file.empty()) {
    throw_error(ErrorCode::kUnavailable, "{}: no such program in PATH; {}", program, remedy);
  }
  return file;
}

ProgramEnd run_program(const std::vector<std::string>& arguments, const std::filesystem::path& log,
                       const std::string& remedy, const std::function<void()>& while_running) {
  throw_if_interrupted();
  const std::string file = require_program(arguments.at(0), remedy);
  const int log_file = open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0644);
  if (log_file < 0) throw_error(ErrorCode::kOutput, "{}: cannot be written", log.string());
  const std::vector<std::string> environment = offscreen_environment();
  const std::vector<char*> argument_pointers = pointers(arguments);
  const std::vector<char*> environment_pointers = pointers(environment);
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child == 0) {
    become(file.c_str(), argument_pointers.data(), environment_pointers.data(), log_file, parent);
  }
  close(log_file);
  if (child < 0) throw_error(ErrorCode::kMemory, "{}: cannot be started", arguments[0]);

  constexpr int kPollsPerCall = 50;
  int status = 0;
  for (int poll = 0;; ++poll) {
    if (while_running && poll % kPollsPerCall == 0) while_running();
    const pid_t ended = waitpid(child, &status, WNOHANG);
    if (ended == child || (ended < 0 && errno != EINTR)) break;
    if (interrupt_requested()) {
      kill(child, SIGKILL);
      waitpid(child, &status, 0);
      throw_if_interrupted();
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  throw_if_interrupted();  // the signal may have reached the child first
  if (WIFSIGNALED(status)) return {0, WTERMSIG(status)};
  if (WEXITSTATUS(status) == kNotStarted) {
    throw_error(ErrorCode::kUnavailable, "{}: cannot be started; {}", file, remedy);
  }
  return {WEXITSTATUS(status), 0};
}

}  // namespace vggtcd
