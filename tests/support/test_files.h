// SPDX-License-Identifier: Apache-2.0
// What tests that touch files share: golden files, scratch directories, the form of an error.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include "vggtcd/core/error.h"
#include "vggtcd/core/progress.h"

namespace vggtcd {

// source_file("tests/golden/npz/vggt.npz")
inline std::filesystem::path source_file(std::string_view path_in_checkout) {
  return std::filesystem::path(VGGTCD_SOURCE_DIR) / path_in_checkout;
}

inline std::string file_bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

inline void write_bytes(const std::filesystem::path& path, std::string_view bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

// A directory of its own, removed at the end of the scope.
class TemporaryDirectory {
 public:
  TemporaryDirectory() {
    std::string name = (std::filesystem::temp_directory_path() / "vggtcd-test-XXXXXX").string();
    check(mkdtemp(name.data()) != nullptr, "mkdtemp");
    path_ = name;
  }
  ~TemporaryDirectory() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  TemporaryDirectory(const TemporaryDirectory&) = delete;
  TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(std::string_view name) const { return path_ / name; }
  size_t num_files() const {
    return static_cast<size_t>(std::distance(std::filesystem::directory_iterator(path_),
                                             std::filesystem::directory_iterator()));
  }

 private:
  std::filesystem::path path_;
};

class RecordingProgress : public ProgressSink {
 public:
  void stage_started(std::string_view) override {}
  void stage_advanced(std::string_view, double) override {}
  void stage_finished(std::string_view, double) override {}
  void notice(std::string_view message) override { notices.emplace_back(message); }
  std::vector<std::string> notices;
};

// "" if the call throws an Error with this code whose message is one line and holds `part`.
template <typename Call>
std::string error_mismatch(const Call& call, ErrorCode code, std::string_view part) {
  try {
    call();
  } catch (const Error& error) {
    const std::string what = error.what();
    if (error.code() != code) return "wrong code for: " + what;
    if (what.find('\n') != std::string::npos) return "more than one line: " + what;
    if (what.find(part) == std::string::npos) return "unexpected message: " + what;
    return "";
  }
  return "no error";
}

}  // namespace vggtcd

#define EXPECT_ERROR(call, code, part) \
  EXPECT_EQ(::vggtcd::error_mismatch([&] { (void)(call); }, code, part), "")
#define EXPECT_INPUT_ERROR(call, part) EXPECT_ERROR(call, ::vggtcd::ErrorCode::kInput, part)
