// SPDX-License-Identifier: Apache-2.0
// Standard output and error as the commands use them: an answer that is lost is an error, a remark
// that is lost is not.
#pragma once

#include <fmt/format.h>

#include <string_view>
#include <utility>

namespace vggtcd::cli {

// Streams that are closed become /dev/null: the first file that is opened would take their place
// otherwise, and get what is printed. To be called before anything is opened.
void open_closed_streams();

// The answer of a command, to standard output. Whether it could be written is said at the end, so
// that no work is given up for it: finish_answer() throws Error{kOutput} if anything is lost.
void write_answer(std::string_view text);
void finish_answer();

template <typename... Args>
void print_answer(fmt::format_string<Args...> format, Args&&... args) {
  write_answer(fmt::format(format, std::forward<Args>(args)...));
}

// "PREFIX TEXT\n" to standard error, at once, with text escaped (io/quote.h): one line, whatever a
// name in it holds. If nobody can be told the work still goes on. Works without memory, too: then
// the text is told as it is.
void tell(std::string_view prefix, std::string_view text) noexcept;

// The same for any text, without an end of line.
void tell_raw(std::string_view text) noexcept;

}  // namespace vggtcd::cli
