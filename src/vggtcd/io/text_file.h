// SPDX-License-Identifier: Apache-2.0
// text_file: the lines of a text file as spreadsheets and scripts save it.
#pragma once

#include <filesystem>
#include <functional>
#include <string_view>

namespace vggtcd {

// Calls use(number, line) for each line, numbers from 1. A byte order mark is dropped; lines end
// with LF, CR LF or CR, which is not part of the line. `expected`: see InputFile. Throws
// Error{kInput} if the file cannot be read or is not text of 8-bit characters (UTF-16, as
// spreadsheets save "Unicode text").
using UseLine = std::function<void(int number, std::string_view line)>;
void for_each_text_line(const std::filesystem::path& path, std::string_view expected,
                        const UseLine& use);

}  // namespace vggtcd
