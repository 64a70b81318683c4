// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/mapped_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/support/test_files.h"
#include "vggtcd/core/interrupt.h"

namespace vggtcd {
namespace {

TEST(ReadFileBytes, GivesTheBytesAndRefusesWhatIsNoFile) {
  const TemporaryDirectory directory;
  const std::string content("a\0b", 3);
  write_bytes(directory / "file", content);
  const std::vector<std::byte> bytes = read_file_bytes(directory / "file");
  EXPECT_EQ(std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()), content);
  write_bytes(directory / "empty", "");
  EXPECT_TRUE(read_file_bytes(directory / "empty").empty());
  EXPECT_INPUT_ERROR(read_file_bytes(directory / "none"),
                     "none: expected a file, found no such file");
  EXPECT_INPUT_ERROR(read_file_bytes(directory.path()), "directory");
  EXPECT_INPUT_ERROR(read_file_bytes("/dev/zero"), "no ordinary file");
}

// Reading what is not there any more would be a SIGBUS.
TEST(MappedFile, ThatIsCutOffReadsAsZerosAndStopsTheJobNamingIt) {
  const TemporaryDirectory directory;
  const auto page = static_cast<size_t>(getpagesize());
  const std::filesystem::path path = directory / "weights";
  write_bytes(path, std::string(5 * page, 'x'));
  const MappedFile file(path);
  EXPECT_NO_THROW(throw_if_interrupted());
  std::filesystem::resize_file(path, page);
  EXPECT_EQ(file.bytes()[page - 1], std::byte{'x'});
  EXPECT_NO_THROW(throw_if_interrupted());
  EXPECT_EQ(file.bytes()[3 * page + 5], std::byte{0});
  EXPECT_INPUT_ERROR(throw_if_interrupted(), "weights: was cut off");
  EXPECT_EQ(file.bytes()[5 * page - 1], std::byte{0});
  EXPECT_EQ(file.bytes()[0], std::byte{'x'});
  clear_interrupt();
  EXPECT_NO_THROW(throw_if_interrupted());
}

}  // namespace
}  // namespace vggtcd
