// SPDX-License-Identifier: Apache-2.0
// TextLine: one line of a text file in words and numbers, with errors that name file and line.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace vggtcd {

// All members throw Error{kInput} "FILE:NUMBER: expected ..., found ...". The line must outlive it.
class TextLine {
 public:
  TextLine(const std::filesystem::path& path, int number, std::string_view line);

  bool is_blank_or_comment() const;  // nothing, or # first
  size_t size() const { return words_.size(); }
  std::string_view word(size_t i) const;
  std::string_view rest(
      size_t i) const;                // from word i to the end of the line, for names with spaces
  double number(size_t i) const;      // finite; a plus may stand before it
  double coordinate(size_t i) const;  // a number that coordinate.h admits
  int64_t integer(size_t i) const;
  // Words at the places of x, y, z and w; a norm within 1 % of 1 is normalised.
  Eigen::Quaterniond unit_quaternion(const std::array<size_t, 4>& xyzw) const;

  void expect_count(size_t count, std::string_view what) const;
  [[noreturn]] void fail(std::string_view expected, std::string_view found) const;

 private:
  std::string where_;
  std::string_view line_;
  std::vector<std::string_view> words_;
};

}  // namespace vggtcd
