// SPDX-License-Identifier: Apache-2.0
// What fuzz targets of readers that take a path share: bytes as files of a directory of the
// process, and what an error must look like.
#pragma once

#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>

#include "vggtcd/core/error.h"

namespace vggtcd::fuzz {

// A condition that must hold, whatever the input; libFuzzer keeps the input where it does not.
inline void require(bool condition) {
  if (!condition) std::abort();
}

// One line of a length that a terminal shows.
inline void check_sentence(const Error& error) {
  require(std::strchr(error.what(), '\n') == nullptr);
  require(std::strlen(error.what()) < 1000);
}

// A refusal that blames the input.
inline void check_refusal(const Error& error) {
  require(error.code() == ErrorCode::kInput);
  check_sentence(error);
}

// A directory of this process in memory where the system has one, removed when it ends.
class FuzzDirectory {
 public:
  FuzzDirectory() {
    const bool in_memory = std::filesystem::is_directory("/dev/shm");
    std::string name =
        in_memory ? "/dev/shm/vggtcd-fuzz-XXXXXX"
                  : (std::filesystem::temp_directory_path() / "vggtcd-fuzz-XXXXXX").string();
    require(mkdtemp(name.data()) != nullptr);
    path_ = name;
  }
  ~FuzzDirectory() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  FuzzDirectory(const FuzzDirectory&) = delete;
  FuzzDirectory& operator=(const FuzzDirectory&) = delete;

  const std::filesystem::path& path() const { return path_; }
  // Replaces the file of this name.
  std::filesystem::path write(const char* name, std::string_view bytes) const {
    const std::filesystem::path file = path_ / name;
    std::ofstream stream(file, std::ios::binary | std::ios::trunc);
    stream << bytes;
    require(stream.good());
    return file;
  }
  void remove(const char* name) const { std::filesystem::remove(path_ / name); }

 private:
  std::filesystem::path path_;
};

// Takes an input apart: a byte, parts with their length (16 bits) before them, and the rest.
class FuzzInput {
 public:
  FuzzInput(const uint8_t* data, size_t size) : rest_(reinterpret_cast<const char*>(data), size) {}

  uint8_t byte() {
    if (rest_.empty()) return 0;
    const auto value = static_cast<uint8_t>(rest_.front());
    rest_.remove_prefix(1);
    return value;
  }
  std::string_view part() {
    const size_t low = byte(), wanted = low | size_t{byte()} << 8;
    const std::string_view taken = rest_.substr(0, wanted);
    rest_.remove_prefix(taken.size());
    return taken;
  }
  std::string_view rest() const { return rest_; }

 private:
  std::string_view rest_;
};

}  // namespace vggtcd::fuzz
