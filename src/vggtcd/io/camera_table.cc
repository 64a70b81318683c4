// SPDX-License-Identifier: Apache-2.0
// camera_table: separators, quotes, decimal signs, headers.
#include "vggtcd/io/camera_table.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "vggtcd/core/error.h"
#include "vggtcd/core/number_text.h"
#include "vggtcd/io/coordinate.h"
#include "vggtcd/io/quote.h"
#include "vggtcd/io/table_columns.h"
#include "vggtcd/io/text_file.h"

namespace vggtcd {
namespace {

constexpr char kSpaces = ' ';  // as a separator: runs of spaces and tabs
constexpr std::string_view kBlank = " \t\v\f";

struct Line {
  int number = 0;
  std::string text;
};

std::string trimmed(std::string_view text) {
  const size_t begin = std::min(text.find_first_not_of(kBlank), text.size());
  text = text.substr(begin, text.find_last_not_of(kBlank) + 1 - std::min(begin, text.size()));
  return std::string(text);
}

std::string uncommented(const std::string& line) {
  return line.substr(std::min(line.find_first_not_of(" \t#"), line.size()));
}

// Takes one field off the line, without its quotes (RFC 4180: a quote in quotes is doubled), and
// what separates it from the next one.
std::string take_field(std::string_view& line, char separator) {
  const auto separates = [&](char c) {
    return separator == kSpaces ? kBlank.find(c) != std::string_view::npos : c == separator;
  };
  while (!line.empty() && kBlank.find(line[0]) != std::string_view::npos && line[0] != separator) {
    line.remove_prefix(1);
  }
  std::string field;
  const bool quoted = line.starts_with('"');
  bool inside = quoted;
  size_t at = quoted ? 1 : 0;
  for (; at < line.size() && (inside || !separates(line[at])); ++at) {
    const bool doubled = inside && line.substr(at).starts_with("\"\"");
    if (inside && line[at] == '"' && !doubled) {
      inside = false;
    } else if (inside || !quoted) {
      field += line[at];
      at += doubled ? 1 : 0;
    }
  }
  line.remove_prefix(std::min(at + 1, line.size()));
  return quoted ? field : trimmed(field);
}

// Empty fields at the end, which spreadsheets leave, are dropped.
std::vector<std::string> split(std::string_view line, char separator) {
  std::vector<std::string> fields;
  while (!line.empty()) {
    std::string field = take_field(line, separator);
    if (!field.empty() || separator != kSpaces) fields.push_back(std::move(field));
  }
  while (!fields.empty() && fields.back().empty()) fields.pop_back();
  return fields;
}

bool has_digit(std::string_view text) {
  return std::ranges::any_of(text, [](char c) { return c >= '0' && c <= '9'; });
}

// A number with a decimal point, or a comma where commas do not separate.
std::optional<double> number_of(const std::string& text, char separator) {
  std::string point = text;
  if (separator != ',' && std::ranges::count(text, ',') == 1 &&
      text.find('.') == std::string::npos) {
    std::ranges::replace(point, ',', '.');
  }
  const auto value = signed_number_in(point);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

size_t count_numbers(const std::vector<std::string>& fields, char separator) {
  return static_cast<size_t>(std::ranges::count_if(
      fields, [&](const std::string& field) { return number_of(field, separator).has_value(); }));
}

class Table {
 public:
  explicit Table(const std::filesystem::path& path) : file_(path.string()) {
    for_each_text_line(path, "camera positions", [&](int number, std::string_view text) {
      if (text.find_first_not_of(" \t\v\f,;\"") == std::string_view::npos) return;
      const bool comment = trimmed(text).front() == '#';
      (comment ? comments_ : lines_).push_back({number, std::string(text)});
    });
  }

  std::vector<ReferenceCamera> read() {
    if (lines_.empty()) return {};
    separator_ = find_separator();
    refuse_coordinate_systems();
    const size_t first = read_header() ? 1 : 0;
    std::vector<ReferenceCamera> cameras;
    for (size_t i = first; i < lines_.size(); ++i) cameras.push_back(read_row(lines_[i]));
    return cameras;
  }

 private:
  [[noreturn]] void fail(int line, std::string_view expected, std::string_view found) const {
    throw_error(ErrorCode::kInput, "{}:{}: expected {}, found {}", file_, line, expected, found);
  }

  // Of the first line that makes sense with one; a decimal comma must not count as one.
  char find_separator() const {
    for (const Line& line : lines_) {
      for (const char separator : {';', '\t', ',', kSpaces}) {
        const std::vector<std::string> fields = split(line.text, separator);
        if (fields.size() >= 4 && count_numbers(fields, separator) >= 3) return separator;
      }
    }
    for (const char separator : {';', '\t', ','}) {
      if (split(lines_.front().text, separator).size() >= 3) return separator;
    }
    return kSpaces;
  }

  // A table that says so itself holds no metres, or nobody knows.
  void refuse_coordinate_systems() const {
    constexpr std::string_view kExpected = "camera positions in metres";
    for (const Line& line : comments_) {
      const std::string unit = unit_against_metres(line.text);
      const bool system = line.text.find(':') != std::string::npos ||
                          line.text.find('[') != std::string::npos ||
                          names_coordinate_system(line.text);
      if (!unit.empty() && system) {
        fail(line.number, kExpected,
             fmt::format("{} ({}); convert them first", unit, quote(trimmed(line.text))));
      }
    }
    const Line& first = lines_.front();
    if (count_numbers(split(first.text, separator_), separator_) >= 3) return;
    if (!names_coordinate_system(first.text)) return;
    fail(
        first.number, kExpected,
        fmt::format("a coordinate system ({}); remove the line if x, y and z are metres, otherwise "
                    "convert them first",
                    quote(trimmed(first.text))));
  }

  // Whether the first line is a heading. A comment before it may be one, too, if it has a word for
  // every column.
  bool read_header() {
    const std::vector<std::string> first = split(lines_.front().text, separator_);
    const bool data = count_numbers(first, separator_) >= 3;
    const TableHeader header = read_table_header(first);
    if (!data && (header.columns || !header.refused.empty())) {
      take(header, lines_.front());
      return true;
    }
    for (const Line& comment : comments_) {
      if (comment.number > lines_.front().number) break;
      const TableHeader found = read_table_header(split(uncommented(comment.text), separator_));
      const bool fits = found.columns && found.columns->count == first.size();
      if (fits || !found.refused.empty()) take(found, comment);
    }
    if (data || std::ranges::any_of(first, has_digit)) return false;
    if (first.size() != columns_.count) {
      fail(lines_.front().number, "a header with name, x, y and z",
           quote(fmt::format("{}", fmt::join(first, ", "))));
    }
    return true;  // four words of any language: name, x, y, z
  }

  void take(const TableHeader& header, const Line& line) {
    if (!header.refused.empty()) {
      fail(line.number, "camera positions in metres (columns x, y, z)",
           fmt::format("the column {}; convert them first", quote(header.refused)));
    }
    const bool said = std::ranges::any_of(
        comments_, [](const Line& comment) { return names_coordinate_system(comment.text); });
    if (header.maybe_degrees && !said) {
      fail(line.number, "camera positions in metres",
           "columns that may be degrees; name them x, y, z if they are metres");
    }
    columns_ = *header.columns;
    has_header_ = true;
  }

  ReferenceCamera read_row(const Line& line) {
    std::vector<std::string> fields = split(line.text, separator_);
    TableColumns columns = columns_;
    if (!has_header_ && fields.size() == 8 && count_numbers(fields, separator_) == 8) {
      columns.count = 8;  // TUM: the time stamp is the name
    }
    if (separator_ == kSpaces) join_name(line, columns, fields);
    const size_t needed = std::max({columns.name, columns.x, columns.y, columns.z}) + 1;
    if (fields.size() < needed) {
      fail(line.number, "name x y z",
           fmt::format("{} {}", fields.size(), separator_ == kSpaces ? "words" : "columns"));
    }
    if (fields.size() > columns.count) {
      fail(line.number, fmt::format("{} columns", columns.count),
           fmt::format("{}; name the columns in a first line (name, x, y, z, ...)", fields.size()));
    }
    ReferenceCamera camera{
        fields[columns.name],
        {coordinate(line, fields[columns.x]), coordinate(line, fields[columns.y]),
         coordinate(line, fields[columns.z])}};
    std::ranges::replace(camera.name, '\\', '/');  // paths of Windows
    if (camera.name.empty()) fail(line.number, "the name of a photo", "an empty field");
    return camera;
  }

  // Where spaces separate, a name of several words stands before exactly three numbers, or before
  // as many words as the header has more.
  void join_name(const Line& line, const TableColumns& columns,
                 std::vector<std::string>& fields) const {
    if (fields.size() <= columns.count || columns.name != 0) return;
    const size_t words = fields.size() - columns.count + 1;
    if (!has_header_ && number_of(fields[words - 1], separator_)) {
      fail(line.number, "name x y z",
           "more than three numbers at the end; name the columns in a first line (name x y z ...)");
    }
    // As the line has it, with all its spaces.
    const std::string text = trimmed(line.text);
    size_t end = 0;
    for (size_t i = 0; i < words; ++i) {
      end = std::min(text.find(fields[i], end), text.size()) + fields[i].size();
    }
    const auto name_end = fields.begin() + static_cast<std::ptrdiff_t>(words);
    const bool quoted = text.find('"') != std::string::npos;
    const std::string name =
        quoted ? fmt::format("{}", fmt::join(fields.begin(), name_end, " ")) : text.substr(0, end);
    fields.erase(fields.begin() + 1, name_end);
    fields[0] = name;
  }

  double coordinate(const Line& line, const std::string& text) {
    const auto value = number_of(text, separator_);
    if (!value) fail(line.number, "a number", quote(text));
    if (!is_coordinate(*value)) fail(line.number, kCoordinateRange, quote(text));
    // 1.234 is a thousand times more where 1,5 has a decimal comma.
    for (const char sign : {'.', ','}) {
      if (text.find(sign) == std::string::npos) continue;
      if (decimal_sign_ != 0 && decimal_sign_ != sign) {
        fail(line.number, "one decimal sign in all lines", quote(text));
      }
      decimal_sign_ = sign;
    }
    return *value;
  }

  std::string file_;
  std::vector<Line> lines_, comments_;
  char separator_ = kSpaces;
  TableColumns columns_;
  bool has_header_ = false;
  char decimal_sign_ = 0;
};

}  // namespace

std::vector<ReferenceCamera> read_camera_table(const std::filesystem::path& path) {
  return Table(path).read();
}

}  // namespace vggtcd
