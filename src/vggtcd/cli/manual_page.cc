// SPDX-License-Identifier: Apache-2.0
// How --help looks: a term and its description in two columns, wrapped to the width of a terminal.
#include "vggtcd/cli/manual_page.h"

#include <sstream>

namespace vggtcd::cli {
namespace {

constexpr size_t kWidth = 80, kColumn = 26;

// Appends the words of a text, at most kWidth to a line, later lines indented. `used` is how much
// of the first line is taken.
void append_wrapped(std::string& page, const std::string& text, size_t used, size_t indent) {
  std::istringstream words(text);
  bool first = true;
  for (std::string word; words >> word; first = false) {
    if (!first && used + 1 + word.size() > kWidth) {
      page += "\n" + std::string(indent, ' ');
      used = indent;
    } else if (!first) {
      page += ' ';
      ++used;
    }
    page += word;
    used += word.size();
  }
  page += '\n';
}

std::string entry(const std::string& term, const std::string& description) {
  std::string page = "  " + term;
  if (page.size() + 2 > kColumn) {
    page += "\n" + std::string(kColumn, ' ');
  } else {
    page.resize(kColumn, ' ');
  }
  append_wrapped(page, description, kColumn, kColumn);
  return page;
}

// "INT", of "INT:INT in [0 - 1024]"; the choices, of "TEXT:{auto,plain}".
std::string type_of(const CLI::Option& option) {
  std::string type = option.get_type_name();
  const size_t check = type.find(':');
  if (check == std::string::npos) return type;
  if (type[check + 1] != '{') return type.substr(0, check);
  type = type.substr(check + 2, type.size() - check - 3);
  return CLI::detail::find_and_replace(type, ",", "|");
}

}  // namespace

std::string ManualPage::make_option(const CLI::Option* option, bool is_positional) const {
  std::string term = option->get_name(is_positional, !is_positional);
  term = CLI::detail::find_and_replace(term, "{false}", "");
  term = CLI::detail::find_and_replace(term, ",", ", ");
  const bool takes_value = option->get_type_size() != 0;
  const std::string type = type_of(*option);
  if (takes_value && !is_positional && !type.empty()) term += " " + type;
  if (option->get_expected_max() == CLI::detail::expected_max_vector_size) term += " ...";
  std::string description = option->get_description();
  if (takes_value && !option->get_default_str().empty()) {
    description += " [" + option->get_default_str() + "]";
  }
  if (option->get_required() && !is_positional) description += " Required.";
  return entry(term, description);
}

std::string ManualPage::make_subcommand(const CLI::App* command) const {
  return entry(command->get_display_name(true), command->get_description());
}

// The base class puts one empty line after the usage and two between groups; here it is one
// everywhere.
std::string ManualPage::make_group(std::string group, bool is_positional,
                                   std::vector<const CLI::Option*> options) const {
  const std::string page = Formatter::make_group(group, is_positional, options).substr(1);
  return is_positional ? page + "\n" : page;
}

std::string ManualPage::make_usage(const CLI::App* app, std::string name) const {
  return Formatter::make_usage(app, name) + "\n";
}

std::string ManualPage::make_description(const CLI::App* app) const {
  std::string page;
  append_wrapped(page, app->get_description(), 0, 0);
  return page + "\n";
}

}  // namespace vggtcd::cli
