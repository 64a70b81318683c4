// SPDX-License-Identifier: Apache-2.0
// quote(): escapes what could break a line or a terminal.
#include "vggtcd/io/quote.h"

#include <fmt/format.h>

namespace vggtcd {

std::string quote(std::string_view text) {
  constexpr size_t kMaxLength = 80;
  std::string result = "\"";
  for (const char c : text.substr(0, kMaxLength)) {
    const bool printable = c >= 0x20 && c < 0x7f && c != '"' && c != '\\';
    if (printable) {
      result += c;
    } else {
      result += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
    }
  }
  result += '"';
  if (text.size() > kMaxLength) result += "...";
  return result;
}

}  // namespace vggtcd
