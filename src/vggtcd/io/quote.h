// SPDX-License-Identifier: Apache-2.0
// Text of untrusted origin (names of files, of tensors) made fit for a line, a terminal, a file.
#pragma once

#include <string>
#include <string_view>

namespace vggtcd {

// In double quotes; control characters and bytes above ASCII as \xNN; at most 80 characters of the
// text, then "...". Names of tensors are ASCII, so nothing worth reading is lost.
std::string quote(std::string_view text);

// For display: what could move a cursor, break a line, reverse the order of reading or is not UTF-8
// becomes \xNN, byte by byte; all other text stays as it is. Every line that reaches a terminal has
// passed it.
std::string escaped(std::string_view text);

// For names of result files and for files with a name in each line: ASCII control characters become
// \xNN, all other bytes stay, UTF-8 or not. Of a result it is the result itself.
std::string single_line(std::string_view name);

// Length in bytes of the UTF-8 character that `text` starts with; 0 if it starts with none.
size_t utf8_length(std::string_view text, char32_t* code = nullptr);

}  // namespace vggtcd
