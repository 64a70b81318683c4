// SPDX-License-Identifier: Apache-2.0
// Fuzz target: any bytes as the list of the files that may be replaced: nothing outside of its
// directory, and what is written reads back; or one line.
#include "tests/fuzz/fuzz_files.h"
#include "vggtcd/io/result_list.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using vggtcd::fuzz::require;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    const vggtcd::ResultList list = vggtcd::ResultList::parse(text, "fuzz");
    for (const std::string& path : list.paths()) {
      require(!path.empty() && path.front() != '/');
      for (const auto& part : std::filesystem::path(path)) require(part != ".." && part != ".");
    }
    if (list.empty()) return 0;
    const vggtcd::ResultList again = vggtcd::ResultList::parse(list.text(), "fuzz");
    require(again.paths() == list.paths() && again.kind() == list.kind());
    require(again.text() == list.text());
  } catch (const vggtcd::Error& error) {
    require(error.code() == vggtcd::ErrorCode::kOutput);
    vggtcd::fuzz::check_sentence(error);
  }
  return 0;
}
