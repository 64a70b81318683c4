// SPDX-License-Identifier: Apache-2.0
// Text that is a number and nothing else, independent of the locale.
#pragma once

#include <charconv>
#include <optional>
#include <string_view>
#include <system_error>

namespace vggtcd {

// The number that the whole text is: decimal, with no space or plus before it; a floating-point
// number may be "inf" or "nan". Nothing if the text is anything else or does not fit T.
template <typename T>
std::optional<T> number_in(std::string_view text) {
  T value{};
  const char* const end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, value);
  if (read.ec != std::errc{} || read.ptr != end) return {};
  return value;
}

// The same for numbers that other programs wrote: a plus may stand before them (printf's %+f).
inline std::optional<double> signed_number_in(std::string_view text) {
  const bool plus = text.starts_with('+');
  if (plus) text.remove_prefix(1);
  return plus && text.starts_with('-') ? std::nullopt : number_in<double>(text);
}

}  // namespace vggtcd
