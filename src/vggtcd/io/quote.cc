// SPDX-License-Identifier: Apache-2.0
// Escapes what could break a line or act on a terminal.
#include "vggtcd/io/quote.h"

#include <fmt/format.h>

#include <algorithm>

namespace vggtcd {
namespace {

bool is_control(char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; }

std::string hexadecimal(std::string_view bytes) {
  std::string result;
  for (const char c : bytes) result += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
  return result;
}

// Controls of a terminal, ends of lines, and what makes text read in another order than it stands.
bool acts_on_display(char32_t code) {
  return code < 0x20 || (code >= 0x7f && code < 0xa0) || code == 0x061c ||
         (code >= 0x200e && code <= 0x200f) || (code >= 0x2028 && code <= 0x202e) ||
         (code >= 0x2066 && code <= 0x2069);
}

}  // namespace

std::string quote(std::string_view text) {
  constexpr size_t kMaxLength = 80;
  std::string result = "\"";
  for (const char c : text.substr(0, kMaxLength)) {
    const bool printable = c >= 0x20 && c < 0x7f && c != '"' && c != '\\';
    result += printable ? std::string(1, c) : hexadecimal({&c, 1});
  }
  result += '"';
  if (text.size() > kMaxLength) result += "...";
  return result;
}

size_t utf8_length(std::string_view text, char32_t* code) {
  if (text.empty()) return 0;
  const auto lead = static_cast<unsigned char>(text[0]);
  const size_t length = lead < 0x80             ? 1
                        : (lead & 0xe0) == 0xc0 ? 2
                        : (lead & 0xf0) == 0xe0 ? 3
                        : (lead & 0xf8) == 0xf0 ? 4
                                                : 0;
  if (length == 0 || length > text.size()) return 0;
  char32_t value = length == 1 ? lead : lead & (0xffu >> (length + 1));
  for (size_t k = 1; k < length; ++k) {
    const auto tail = static_cast<unsigned char>(text[k]);
    if ((tail & 0xc0) != 0x80) return 0;
    value = value << 6 | (tail & 0x3fu);
  }
  constexpr char32_t kSmallest[] = {0, 0, 0x80, 0x800, 0x10000};  // of each length: no detours
  if (value < kSmallest[length] || value > 0x10ffff || (value >= 0xd800 && value < 0xe000)) {
    return 0;
  }
  if (code != nullptr) *code = value;
  return length;
}

std::string escaped(std::string_view text) {
  std::string result;
  while (!text.empty()) {
    char32_t code = 0;
    const size_t length = utf8_length(text, &code);
    const std::string_view character = text.substr(0, std::max<size_t>(1, length));
    result +=
        length == 0 || acts_on_display(code) ? hexadecimal(character) : std::string(character);
    text.remove_prefix(character.size());
  }
  return result;
}

std::string single_line(std::string_view name) {
  std::string result;
  for (const char c : name) result += is_control(c) ? hexadecimal({&c, 1}) : std::string(1, c);
  return result;
}

}  // namespace vggtcd
