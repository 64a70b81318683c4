// SPDX-License-Identifier: Apache-2.0
// InputFile: the one way in which a file is opened for reading. A pipe or a device is refused, not
// waited for; every read can be interrupted; a read error is an error, not the end of the file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <istream>
#include <string>
#include <string_view>

#include "vggtcd/io/input_descriptor.h"

namespace vggtcd {

class InputFile : public std::istream {
 public:
  // `expected` is what the caller wants to find ("a trajectory"). Throws Error{kInput} "FILE:
  // expected a trajectory, found no such file", likewise for what is no ordinary file or may not be
  // read. Reading throws Error{kInput} for read errors and Error{kInterrupted}.
  InputFile(const std::filesystem::path& path, std::string_view expected);

  uint64_t size() const { return buffer_.descriptor.size(); }
  std::string read_all();

 private:
  struct Buffer : std::streambuf {
    explicit Buffer(InputDescriptor file) : descriptor(std::move(file)) {}
    int_type underflow() override;
    pos_type seekoff(off_type offset, std::ios_base::seekdir from,
                     std::ios_base::openmode) override;
    pos_type seekpos(pos_type position, std::ios_base::openmode which) override;

    InputDescriptor descriptor;
    std::string bytes;
  };
  Buffer buffer_;
};

}  // namespace vggtcd
