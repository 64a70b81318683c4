// SPDX-License-Identifier: Apache-2.0
// Subcommands: the options that all of them share.
#include "vggtcd/cli/command.h"

namespace vggtcd::cli {

CLI::App* add_command(Program& program, CLI::App& parent, const std::string& name,
                      const std::string& description, Action run) {
  CLI::App* command = parent.add_subcommand(name, description);
  command
      ->add_option("--threads", program.common.threads,
                   "Threads to use; 0 takes every processor. The result does not depend on it.")
      ->capture_default_str()
      ->check(CLI::Range(0, 1024))
      ->group("General");
  command
      ->add_option("--progress", program.common.progress,
                   "auto: a live line on a terminal, plain lines in a log; or plain, json, none.")
      ->capture_default_str()
      ->check(CLI::IsMember({"auto", "plain", "json", "none"}))
      ->group("General");
  command->callback([&program, run = std::move(run)] { program.action = run; });
  return command;
}

std::string flag_of(std::string_view field) {
  std::string flag = "--" + std::string(field);
  for (char& c : flag) {
    if (c == '_') c = '-';
  }
  return flag;
}

}  // namespace vggtcd::cli
