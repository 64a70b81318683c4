// SPDX-License-Identifier: Apache-2.0
// InputDescriptor: an ordinary file open for reading, as a descriptor of the system.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>

namespace vggtcd {

class InputDescriptor {
 public:
  // Throws Error{kInput} "FILE: expected EXPECTED, found ..." if nothing is there, or no ordinary
  // file, or one that may not be read. Never waits for a pipe or a device.
  InputDescriptor(const std::filesystem::path& path, std::string_view expected);
  ~InputDescriptor();
  InputDescriptor(InputDescriptor&& other) noexcept;
  InputDescriptor& operator=(InputDescriptor&&) = delete;

  int number() const { return number_; }
  uint64_t size() const { return size_; }  // when it was opened
  // As many bytes as there are, up to all; 0 at the end. Throws Error{kInput}, Error{kInterrupted}.
  size_t read(std::span<char> bytes) const;

 private:
  std::filesystem::path path_;
  int number_ = -1;
  uint64_t size_ = 0;
};

}  // namespace vggtcd
