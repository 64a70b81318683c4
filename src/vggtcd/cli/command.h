// SPDX-License-Identifier: Apache-2.0
// What a subcommand is: a function that adds its options to the program and says what to run.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <string>

#include "vggtcd/core/error.h"
#include "vggtcd/core/options.h"
#include "vggtcd/core/progress.h"

namespace vggtcd::cli {

// Options that every subcommand has.
struct CommonOptions {
  int threads = 0;                // 0: all processors
  std::string progress = "auto";  // auto, plain, json, none
};

// Set by the subcommand that was named; run by main() with the chosen progress display.
using Action = std::function<void(ProgressSink&)>;

struct Program {
  CLI::App app;
  CommonOptions common;
  Action action;
};

// Adds a subcommand with the common options. `run` is called when the user names it.
CLI::App* add_command(Program& program, CLI::App& parent, const std::string& name,
                      const std::string& description, Action run);

// The subcommands, one .cc each, in the order of --help.
void add_detect(Program& program);
void add_register(Program& program);
void add_view(Program& program);
void add_reconstruct(Program& program);
void add_weights(Program& program);
void add_synthesize(Program& program);
void add_benchmark(Program& program);
void add_evaluate(Program& program);

// The flag of a field: static_factor -> --static-factor.
std::string flag_of(std::string_view field);

template <typename Field>
void add_field(CLI::App* command, std::string_view name, Field& field, std::string_view help) {
  const std::string flag = flag_of(name);
  if constexpr (std::is_same_v<Field, bool>) {
    command->add_flag(flag + ",!--no-" + flag.substr(2), field,
                      std::string(help) + (field ? " [on]" : " [off]"));
  } else if constexpr (std::is_enum_v<Field>) {
    std::string names;
    for (const auto& entry : enum_names(Field{})) {
      names += (names.empty() ? "" : "|") + std::string(entry.name);
    }
    command
        ->add_option_function<std::string>(
            flag,
            [&field, flag, names](const std::string& text) {
              for (const auto& entry : enum_names(Field{})) {
                if (entry.name == text) {
                  field = entry.value;
                  return;
                }
              }
              throw_error(ErrorCode::kUsage, "{}: expected {}, found {}", flag, names, text);
            },
            std::string(help))
        ->type_name(names)
        ->default_str(std::string(enum_to_string(field)));
  } else {
    command->add_option(flag, field, std::string(help))->capture_default_str();
  }
}

// Adds one flag per field of an options struct (core/options.h) to the command, in one help group.
template <typename Options>
void add_fields(CLI::App* command, Options& options, const std::string& group) {
  for_each_field(options, [&](std::string_view name, auto& field, std::string_view help) {
    if constexpr (requires { std::remove_reference_t<decltype(field)>::fields; }) {
      add_fields(command, field, group);
    } else {
      add_field(command, name, field, help);
      command->get_option(flag_of(name))->group(group);
    }
  });
}

// The one field of this name, with the help that its options declare.
template <typename Options>
void add_field_of(CLI::App* command, Options& options, std::string_view wanted,
                  const std::string& group) {
  for_each_field(options, [&](std::string_view name, auto& field, std::string_view help) {
    if constexpr (!requires { std::remove_reference_t<decltype(field)>::fields; }) {
      if (name != wanted) return;
      add_field(command, name, field, help);
      command->get_option(flag_of(name))->group(group);
    }
  });
}

}  // namespace vggtcd::cli
