// SPDX-License-Identifier: Apache-2.0
// text_file: encodings and ends of lines.
#include "vggtcd/io/text_file.h"

#include <algorithm>

#include "vggtcd/core/error.h"
#include "vggtcd/core/interrupt.h"
#include "vggtcd/io/input_file.h"

namespace vggtcd {

void for_each_text_line(const std::filesystem::path& path, std::string_view expected,
                        const UseLine& use) {
  const std::string bytes = InputFile(path, expected).read_all();
  std::string_view rest = bytes;
  if (rest.starts_with("\xff\xfe") || rest.starts_with("\xfe\xff")) {
    throw_error(ErrorCode::kInput,
                "{}: expected text in UTF-8, found UTF-16; save it as \"CSV UTF-8\"",
                path.string());
  }
  if (rest.starts_with("\xef\xbb\xbf")) rest.remove_prefix(3);
  for (int number = 1; !rest.empty(); ++number) {
    if (number % 4096 == 0) throw_if_interrupted();
    const size_t end = std::min(rest.find_first_of("\r\n"), rest.size());
    const std::string_view line = rest.substr(0, end);
    const bool two = rest.substr(end).starts_with("\r\n");
    rest.remove_prefix(std::min(end + (two ? 2 : 1), rest.size()));
    use(number, line);
  }
}

}  // namespace vggtcd
