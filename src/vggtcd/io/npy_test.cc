// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/npy.h"

#include <gmock/gmock.h>

#include <cstring>
#include <fstream>
#include <iterator>

#include "tests/support/test_files.h"
#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// A .npy stream held in memory.
ReadBytes from(const std::string& bytes) {
  return [bytes, position = size_t{0}](std::span<std::byte> target) mutable {
    if (bytes.size() - position < target.size()) throw Error(ErrorCode::kInput, "truncated");
    std::memcpy(target.data(), bytes.data() + position, target.size());
    position += target.size();
  };
}

std::string with_dict(std::string dict, char version = 1) {
  std::string bytes("\x93NUMPY", 6);
  bytes += version;
  bytes += '\0';
  bytes += static_cast<char>(dict.size() & 0xff);
  bytes += static_cast<char>(dict.size() >> 8);
  if (version > 1) bytes += std::string(2, '\0');
  return bytes + dict;
}

TEST(NpyHeader, IsTheOneThatNumpyWrites) {
  std::ifstream file(source_file("tests/golden/npz/f32_2x3.npy"), std::ios::binary);
  const std::string bytes(std::istreambuf_iterator<char>(file), {});
  const std::vector<int64_t> shape{2, 3};
  EXPECT_EQ(bytes.substr(0, 128), npy_header("<f4", shape));
}

TEST(NpyHeader, ReadsWhatItWrites) {
  for (const std::vector<int64_t>& shape :
       {std::vector<int64_t>{}, {0}, {7}, {1, 2, 3}, {1000000, 1000000}}) {
    const NpyHeader header = read_npy_header(from(npy_header("|u1", shape)), "x");
    EXPECT_EQ(header.shape, shape);
    EXPECT_EQ(header.kind, NpyKind::kUnsigned);
    EXPECT_FALSE(header.fortran_order);
  }
}

TEST(NpyHeader, AcceptsAnyOrderOfKeysSpacingAndPythonTwoLongs) {
  const NpyHeader header = read_npy_header(
      from(with_dict("{ \"shape\" :(3L ,4L), 'fortran_order':True,'descr':\"<i8\"}\n", 2)), "x");
  EXPECT_THAT(header.shape, ElementsAre(3, 4));
  EXPECT_EQ(header.descr, "<i8");
  EXPECT_TRUE(header.fortran_order);
}

TEST(NpyHeader, RefusesWhatNumpyDoesNotWriteInOneLineNamingTheArray) {
  const std::string dicts[] = {
      "",
      "{",
      "{}",
      "{'descr': '<f4', 'fortran_order': False}",
      "{'descr': '<f4', 'fortran_order': False, 'shape': (3, 4), 'more': 1}",
      "{'descr': '<f4', 'descr': '<f4', 'fortran_order': False, 'shape': (3,)}",
      "{'descr': '<f4', 'fortran_order': Maybe, 'shape': (3, 4)}",
      "{'descr': '<f4', 'fortran_order': False, 'shape': (3, -4)}",
      "{'descr': '<f4', 'fortran_order': False, 'shape': (3 4)}",
      "{'descr': '<f4', 'fortran_order': False, 'shape': (99999999999999999999,)}",
      "{'descr': '<f8', 'fortran_order': False, 'shape': (4294967296, 4294967296)}",
      "{'descr': '<f8', 'fortran_order': False, 'shape': (0, 4294967296, 4294967296)}",
      // The size in bytes is 2^64 and a little more: what is there would seem to be enough.
      "{'descr': '<f8', 'fortran_order': False, 'shape': (2305843009213693952,)}",
      "{'descr': '<f8', 'fortran_order': False, 'shape': (144115188075855873, 4, 4)}",
      "{'descr': '<i8', 'fortran_order': False, 'shape': (2305843009213693955,)}",
      "{'descr': '<U536870912', 'fortran_order': False, 'shape': (8589934592,)}",
      "{'descr': [('a', '<f4', 'fortran_order': False, 'shape': (3, 4)}",
      "{'descr': '<f4', 'fortran_order': False, 'shape': (3, 4)} trailing",
  };
  for (const std::string& dict : dicts) {
    EXPECT_INPUT_ERROR(read_npy_header(from(with_dict(dict)), "a.npz: depth"),
                       "a.npz: depth: expected an array header");
  }
  EXPECT_INPUT_ERROR(read_npy_header(from(with_dict("{}", 4)), "x"), "found 4.0");
  EXPECT_INPUT_ERROR(read_npy_header(from("PK345678"), "x"), "found other data");
}

TEST(NpyFile, GivesFortranOrderInCOrder) {
  const NpyDoubles array = read_npy_file(source_file("tests/golden/npz/f64_fortran_4x3x4.npy"));
  EXPECT_THAT(array.shape, ElementsAre(4, 3, 4));
  ASSERT_EQ(array.values.size(), 48u);
  for (size_t i = 0; i < 48; ++i) EXPECT_EQ(array.values[i], static_cast<double>(i));
}

TEST(NpyFile, ReadsWhatItWrites) {
  const TemporaryDirectory directory;
  const std::vector<int64_t> shape{2, 2};
  const std::vector<double> values{1.5, -2, 1e300, 0};
  write_npy_file(directory / "a.npy", shape, values);
  const NpyDoubles array = read_npy_file(directory / "a.npy");
  EXPECT_EQ(array.shape, shape);
  EXPECT_EQ(array.values, values);
}

TEST(NpyFile, RefusesTruncatedAndMissingFiles) {
  const TemporaryDirectory directory;
  EXPECT_INPUT_ERROR(read_npy_file(directory / "none.npy"), "none.npy");
  EXPECT_INPUT_ERROR(read_npy_file(directory.path()),
                     "expected a readable .npy file, found a directory");
  std::filesystem::copy_file(source_file("tests/golden/npz/f32_2x3.npy"), directory / "short.npy");
  std::filesystem::resize_file(directory / "short.npy", 128 + 23);
  EXPECT_INPUT_ERROR(read_npy_file(directory / "short.npy"), "expected 24 bytes of data, found 23");
  std::filesystem::resize_file(directory / "short.npy", 70);
  EXPECT_INPUT_ERROR(read_npy_file(directory / "short.npy"), "found the end of the file");
}

}  // namespace
}  // namespace vggtcd
