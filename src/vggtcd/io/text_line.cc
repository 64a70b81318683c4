// SPDX-License-Identifier: Apache-2.0
// TextLine: splitting and numbers, independent of the locale.
#include "vggtcd/io/text_line.h"

#include <cmath>

#include "vggtcd/core/error.h"
#include "vggtcd/core/number_text.h"
#include "vggtcd/io/coordinate.h"

namespace vggtcd {
namespace {

constexpr std::string_view kSpace = " \t\r\n";

}  // namespace

TextLine::TextLine(const std::filesystem::path& path, int number, std::string_view line)
    : where_(fmt::format("{}:{}", path.string(), number)), line_(line) {
  size_t begin = 0;
  while ((begin = line.find_first_not_of(kSpace, begin)) != std::string_view::npos) {
    const size_t end = std::min(line.find_first_of(kSpace, begin), line.size());
    words_.push_back(line.substr(begin, end - begin));
    begin = end;
  }
}

bool TextLine::is_blank_or_comment() const { return words_.empty() || words_[0][0] == '#'; }

std::string_view TextLine::word(size_t i) const {
  if (i >= words_.size()) fail(fmt::format("at least {} words", i + 1), "fewer");
  return words_[i];
}

std::string_view TextLine::rest(size_t i) const {
  const auto begin = static_cast<size_t>(word(i).data() - line_.data());
  return line_.substr(begin, line_.find_last_not_of(kSpace) + 1 - begin);
}

double TextLine::number(size_t i) const {
  const std::string_view text = word(i);
  const auto value = signed_number_in(text);
  if (!value || !std::isfinite(*value)) {
    const bool comma = text.find(',') != std::string_view::npos;
    fail(comma ? "a number with a decimal point" : "a number", text);
  }
  return *value;
}

double TextLine::coordinate(size_t i) const {
  const double value = number(i);
  if (!is_coordinate(value)) fail(kCoordinateRange, word(i));
  return value;
}

int64_t TextLine::integer(size_t i) const {
  const std::string_view text = word(i);
  const auto value = number_in<int64_t>(text);
  if (!value) fail("an integer", text);
  return *value;
}

Eigen::Quaterniond TextLine::unit_quaternion(const std::array<size_t, 4>& xyzw) const {
  const Eigen::Quaterniond q(number(xyzw[3]), number(xyzw[0]), number(xyzw[1]), number(xyzw[2]));
  if (std::abs(q.norm() - 1) > 1e-2) {
    fail("a unit quaternion", fmt::format("norm {:.4g}", q.norm()));
  }
  return q.normalized();
}

void TextLine::expect_count(size_t count, std::string_view what) const {
  if (words_.size() != count) fail(what, fmt::format("{} words", words_.size()));
}

void TextLine::fail(std::string_view expected, std::string_view found) const {
  // What was found may be any bytes; only the printable ones are shown.
  std::string shown;
  for (const char c : found.substr(0, 60)) shown += c >= 0x20 && c < 0x7f ? c : '?';
  throw_error(ErrorCode::kInput, "{}: expected {}, found {}", where_, expected, shown);
}

}  // namespace vggtcd
