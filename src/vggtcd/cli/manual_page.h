// SPDX-License-Identifier: Apache-2.0
// How --help looks: a term and its description in two columns, wrapped to the width of a terminal.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace vggtcd::cli {

// Defaults stand at the end of a description, in brackets.
class ManualPage : public CLI::Formatter {
 public:
  std::string make_option(const CLI::Option* option, bool is_positional) const override;
  std::string make_subcommand(const CLI::App* command) const override;
  std::string make_group(std::string group, bool is_positional,
                         std::vector<const CLI::Option*> options) const override;
  std::string make_usage(const CLI::App* app, std::string name) const override;
  std::string make_description(const CLI::App* app) const override;
};

}  // namespace vggtcd::cli
