// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/npz.h"

#include <gmock/gmock.h>

#include <cstdlib>

#include "tests/support/test_files.h"
#include "tests/support/torch_writer.h"

namespace vggtcd {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::Not;

// The formulas of tests/golden/npz/make.py.
class NpzGolden : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Files, NpzGolden,
                         ::testing::Values("tests/golden/npz/types_stored.npz",
                                           "tests/golden/npz/types_deflated_zip64.npz"));

TEST_P(NpzGolden, EveryNumberTypeReadsAsNumpySavedIt) {
  const NpzReader npz(source_file(GetParam()));
  const auto expect = [&](const char* key, auto formula) {
    EXPECT_THAT(npz.header(key).shape, ElementsAre(3, 4)) << key;
    const std::vector<double> values = npz.read<double>(key);
    const std::vector<float> floats = npz.read<float>(key);
    for (int i = 0; i < 12; ++i) {
      EXPECT_EQ(values[static_cast<size_t>(i)], static_cast<double>(formula(i))) << key << " " << i;
      EXPECT_EQ(floats[static_cast<size_t>(i)], static_cast<float>(formula(i))) << key << " " << i;
    }
  };
  expect("f16", [](int i) { return i * 0.25 - 1; });
  expect("f32", [](int i) { return static_cast<float>(i * 0.1); });
  expect("f64", [](int i) { return i / 7.0; });
  expect("i8", [](int i) { return i - 5; });
  expect("i16", [](int i) { return i * -1000; });
  expect("i32", [](int i) { return i * 100000000; });
  expect("i64", [](int i) { return i * 100000000000000000; });
  expect("u8", [](int i) { return i * 20; });
  expect("u16", [](int i) { return i * 5000; });
  expect("u32", [](int i) { return i * 300000000ll; });
  expect("bool", [](int i) { return i % 3 == 0; });
}

TEST_P(NpzGolden, IntegersAndBytesReadExactly) {
  const NpzReader npz(source_file(GetParam()));
  for (const char* key : {"i8", "i16", "i32", "i64", "u8", "u16", "u32"}) {
    const std::vector<double> expected = npz.read<double>(key);
    const std::vector<int64_t> values = npz.read<int64_t>(key);
    EXPECT_TRUE(std::equal(values.begin(), values.end(), expected.begin())) << key;
  }
  EXPECT_EQ(npz.read<int64_t>("i64")[11], 1100000000000000000);
  EXPECT_THAT(npz.read<uint8_t>("bool"), ElementsAre(1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0));
  EXPECT_THAT(npz.read<uint8_t>("u8"),
              ElementsAre(0, 20, 40, 60, 80, 100, 120, 140, 160, 180, 200, 220));
}

TEST_P(NpzGolden, ScalarsEmptyArraysAndFortranOrder) {
  const NpzReader npz(source_file(GetParam()));
  EXPECT_TRUE(npz.header("scalar").shape.empty());
  EXPECT_THAT(npz.read<float>("scalar"), ElementsAre(2.5f));
  EXPECT_THAT(npz.read<float>("empty"), ElementsAre());
  EXPECT_THAT(npz.read<double>("fortran_f64"), ElementsAre(0, 1, 2, 3, 4, 5));
  const std::vector<float> values = npz.read<float>("fortran");
  std::vector<float> streamed;
  npz.read_slabs<float>("fortran", [&](int64_t first, std::span<const float> slab) {
    EXPECT_EQ(static_cast<size_t>(first), streamed.size());
    streamed.insert(streamed.end(), slab.begin(), slab.end());
  });
  for (size_t i = 0; i < 24; ++i) EXPECT_EQ(values[i], static_cast<float>(i));
  EXPECT_EQ(streamed, values);
}

TEST_P(NpzGolden, TextIsUtf8WithoutPadding) {
  const NpzReader npz(source_file(GetParam()));
  EXPECT_THAT(npz.read_strings("text"), ElementsAre("a.jpg", "Straße 東京 😀", ""));
  EXPECT_THAT(npz.read_strings("bytes"), ElementsAre("left", "r"));
}

TEST_P(NpzGolden, ObjectArraysAreSkipped) {
  const NpzReader npz(source_file(GetParam()));
  EXPECT_THAT(npz.keys(), Not(Contains("object")));
  EXPECT_FALSE(npz.has("none"));
  EXPECT_TRUE(npz.has("f32"));
}

TEST_P(NpzGolden, WrongTypesAreRefusedByName) {
  const NpzReader npz(source_file(GetParam()));
  EXPECT_INPUT_ERROR(npz.read<float>("big"), "big: expected little-endian data, found type >f4");
  EXPECT_INPUT_ERROR(npz.read<float>("complex"), "complex: expected numbers, found type <c8");
  EXPECT_INPUT_ERROR(npz.read<float>("struct"), "struct: expected numbers, found type [('a'");
  EXPECT_INPUT_ERROR(npz.read<double>("text"), "text: expected numbers, found type <U");
  EXPECT_INPUT_ERROR(npz.read<int64_t>("f32"), "f32: expected integers, found type <f4");
  EXPECT_INPUT_ERROR(npz.read<uint8_t>("i16"), "i16: expected 8-bit unsigned");
  EXPECT_INPUT_ERROR(npz.read<int64_t>("u64"), "u64: expected integers below 2^63");
  EXPECT_INPUT_ERROR(npz.read_strings("f32"), "f32: expected a list of text");
  EXPECT_INPUT_ERROR(npz.read<float>("depth"), "expected an array depth, found f16, f32");
  const std::vector<int64_t> shape{-1, 5};
  EXPECT_INPUT_ERROR(npz.expect_shape("f32", shape), "f32: expected shape [-1, 5], found [3, 4]");
}

TEST(NpzReader, ReadsHeadersOfVersionTwoAndThree) {
  for (const char* name : {"tests/golden/npz/version_2.npz", "tests/golden/npz/version_3.npz"}) {
    const NpzReader npz(source_file(name));
    EXPECT_EQ(npz.read<float>("fortran")[23], 23.0f);
    EXPECT_EQ(npz.read_strings("text")[0], "a.jpg");
  }
}

TEST(NpzReader, SaysWhatIsThereInsteadOfAnNpz) {
  const TemporaryDirectory directory;
  const auto expect = [&](std::string_view content, std::string_view found) {
    write_bytes(directory / "x.npz", content);
    EXPECT_INPUT_ERROR(NpzReader(directory / "x.npz"), found);
  };
  expect("", "found an empty file");
  expect("version https://git-lfs.github.com/spec/v1\n", "found a Git LFS pointer");
  expect("<!DOCTYPE html>", "found a web page");
  expect("\x93NUMPY...", "found a single .npy array");
  expect("some text", "found other data");
  expect(std::string("PK\5\6", 4) + std::string(18, '\0'), "found an empty archive");
  EXPECT_INPUT_ERROR(NpzReader(directory / "none.npz"), "found no such file");
  EXPECT_INPUT_ERROR(NpzReader(directory.path()), "found a directory");
}

// Reads everything that a file offers.
void read_all(const NpzReader& npz) {
  for (const std::string& key : npz.keys()) {
    const NpyKind kind = npz.header(key).kind;
    if (kind == NpyKind::kUnicode || kind == NpyKind::kBytes) {
      npz.read_strings(key);
    } else if (kind != NpyKind::kOther && !npz.header(key).big_endian) {
      npz.read<double>(key);
    }
  }
}

TEST(NpzReader, TruncationAnywhereIsAnInputError) {
  const std::string whole = file_bytes(source_file("tests/golden/npz/vggt_half.npz"));
  for (size_t size = 0; size < whole.size(); size += 97) {
    const std::string cut = whole.substr(0, size);
    EXPECT_INPUT_ERROR(read_all(NpzReader(std::as_bytes(std::span(cut)), "cut.npz")), "cut.npz: ")
        << size;
  }
}

TEST(NpzReader, ADamagedByteInTheDataIsAnInputError) {
  for (const char* name : {"tests/golden/npz/vggt.npz", "tests/golden/npz/vggt_half.npz"}) {
    std::string bytes = file_bytes(source_file(name));
    const std::string whole = bytes;
    // The middle of each member's data: the checksum or the decompressor must notice.
    for (size_t at = whole.find("PK\x03\x04"); at != std::string::npos;
         at = whole.find("PK\x03\x04", at + 4)) {
      const size_t next = std::min(whole.find("PK\x03\x04", at + 4), whole.find("PK\x01\x02"));
      if (next - at < 700) continue;  // the object array is not read
      bytes = whole;
      bytes[at + (next - at) / 2] ^= 0x10;
      EXPECT_INPUT_ERROR(read_all(NpzReader(std::as_bytes(std::span(bytes)), "bad.npz")),
                         "bad.npz: ")
          << name << " " << at;
    }
  }
}

TEST(NpzReader, ASizeThatTheShapeDoesNotNeedIsAnInputError) {
  // In a stored file the shape (2, 3) can be changed to (3, 3) in place.
  const TemporaryDirectory directory;
  const std::vector<float> values(6);
  NpzWriter writer(directory / "a.npz");
  writer.add<float>("x", {2, 3}, values);
  writer.finish();
  std::string bytes = file_bytes(directory / "a.npz");
  bytes.replace(bytes.find("(2, 3)"), 6, "(3, 3)");
  EXPECT_INPUT_ERROR(NpzReader(std::as_bytes(std::span(bytes)), "a.npz"),
                     "a.npz: x: expected 36 bytes of data for shape [3, 3], found 24");
}

TEST(NpzReader, NamesAndTypesCannotBreakTheLineOfAMessage) {
  const TemporaryDirectory directory;
  const std::vector<float> values(6);
  for (const std::string key : {"two\nlines", "x"}) {
    NpzWriter writer(directory / "a.npz");
    writer.add<float>(key, {2, 3}, values);
    writer.finish();
    std::string bytes = file_bytes(directory / "a.npz");
    if (key == "x") bytes.replace(bytes.find("'<f4'"), 5, "'<\n4'");
    const auto read = [&] { NpzReader(std::as_bytes(std::span(bytes)), "a.npz").read<float>(key); };
    EXPECT_INPUT_ERROR(read(), "a.npz: ");
  }
}

TEST(NpzReader, AnArrayOfNoNumbersIsRefusedBeforeMemoryIsReserved) {
  const TemporaryDirectory directory;
  const std::vector<int64_t> huge{int64_t{1} << 60};
  for (const char* descr : {"<c16", "<U0", "<M8[ns]"}) {
    const std::string npy = npy_header(descr, huge);
    const std::pair<std::string, std::string> member{"a.npy", npy};
    write_bytes(directory / "a.npz", vggtcd::testing::stored_zip({&member, 1}));
    const NpzReader npz(directory / "a.npz");
    EXPECT_INPUT_ERROR(npz.read<double>("a"), "a.npz: a: expected numbers, found type");
    EXPECT_INPUT_ERROR(npz.read_slabs<double>("a", [](int64_t, std::span<const double>) {}),
                       "a.npz: a: expected numbers, found type");
  }
}

TEST(NpzReader, WhatMacosAddsIsNoArray) {
  const TemporaryDirectory directory;
  const std::vector<int64_t> one{1};
  const std::string side = std::string("\0\5\x16\7\0\2\0\0", 8) + "Mac OS X        ";
  const std::vector<std::pair<std::string, std::string>> members = {
      {"x.npy", npy_header("|u1", one) + "\7"},
      {"__MACOSX/._x.npy", side},
      {"._x.npy", side},
      {"part/._y.npy", side}};
  write_bytes(directory / "a.npz", vggtcd::testing::stored_zip(members));
  const NpzReader npz(directory / "a.npz");
  EXPECT_THAT(npz.keys(), ElementsAre("x"));
  EXPECT_THAT(npz.read<uint8_t>("x"), ElementsAre(7));
}

TEST(NpzReader, SingleSurrogatesOfPythonAreTheBytesTheyStandFor) {
  const TemporaryDirectory directory;
  const std::vector<int64_t> one{1};
  std::string npy = npy_header("<U3", one);
  for (const uint32_t code : {0x4bu, 0xdcfcu, 0x63u}) {
    npy.append(reinterpret_cast<const char*>(&code), sizeof(code));
  }
  const std::pair<std::string, std::string> member{"names.npy", npy};
  write_bytes(directory / "a.npz", vggtcd::testing::stored_zip({&member, 1}));
  EXPECT_THAT(NpzReader(directory / "a.npz").read_strings("names"), ElementsAre("K\xfc"
                                                                                "c"));
}

TEST(NpzWriter, ReaderGetsBackWhatWasAdded) {
  const TemporaryDirectory directory;
  const std::vector<float> f{1.5f, -2, 3};
  const std::vector<double> d{1e300};
  const std::vector<int32_t> i{-7, 7};
  const std::vector<int64_t> l{int64_t{1} << 62};
  const std::vector<uint8_t> u{0, 1, 255, 3};
  const std::vector<uint8_t> mask{0, 1};
  const std::vector<std::string> names{"a.png", "Straße 😀.jpg", "", "bad \xff byte"};
  for (const NpzCompression compression : {NpzCompression::kStored, NpzCompression::kDeflate}) {
    NpzWriter writer(directory / "a.npz", compression);
    writer.add<float>("f", {3, 1}, f);
    writer.add<double>("d", {}, d);
    writer.add<int32_t>("i", {2}, i);
    writer.add<int64_t>("l", {1}, l);
    writer.add<uint8_t>("u", {2, 2}, u);
    writer.add_mask("mask", {2}, mask);
    writer.add<float>("empty", {0, 3}, std::span<const float>());
    writer.add_strings("names", names);
    writer.finish();
    const NpzReader npz(directory / "a.npz");
    EXPECT_THAT(npz.keys(), ElementsAre("f", "d", "i", "l", "u", "mask", "empty", "names"));
    EXPECT_THAT(npz.header("f").shape, ElementsAre(3, 1));
    EXPECT_EQ(npz.read<float>("f"), f);
    EXPECT_EQ(npz.read<double>("d"), d);
    EXPECT_EQ(npz.read<int64_t>("i"), (std::vector<int64_t>{-7, 7}));
    EXPECT_EQ(npz.read<int64_t>("l"), l);
    EXPECT_EQ(npz.read<uint8_t>("u"), u);
    EXPECT_EQ(npz.header("mask").kind, NpyKind::kBool);
    EXPECT_EQ(npz.read<uint8_t>("mask"), mask);
    EXPECT_THAT(npz.read_strings("names"), ElementsAre("a.png", "Straße 😀.jpg", "", names[3]));
  }
}

TEST(NpzWriter, SameArraysGiveSameBytes) {
  const TemporaryDirectory directory;
  const std::vector<float> values(100, 1.0f);
  for (const char* name : {"a.npz", "b.npz"}) {
    NpzWriter writer(directory / name, NpzCompression::kDeflate);
    writer.add<float>("x", {100}, values);
    writer.finish();
  }
  const std::string bytes = file_bytes(directory / "a.npz");
  EXPECT_EQ(bytes, file_bytes(directory / "b.npz"));
  // DOS time 00:00 and date 1980-01-01 in the local header: nothing of today.
  EXPECT_EQ(bytes.substr(10, 4), std::string("\x00\x00\x21\x00", 4));
}

TEST(NpzWriter, ValuesMadeWhileWritingGiveTheSameBytesAsValuesAtHand) {
  const TemporaryDirectory directory;
  constexpr size_t kCount = 200001;  // several pieces, the last one short
  std::vector<float> values(kCount);
  std::vector<uint8_t> mask(kCount);
  for (size_t i = 0; i < kCount; ++i) {
    values[i] = 0.5f * static_cast<float>(i);
    mask[i] = i % 3 == 0 ? 1 : 0;
  }
  const std::vector<int64_t> shape = {static_cast<int64_t>(kCount)};
  NpzWriter at_hand(directory / "a.npz"), made(directory / "b.npz");
  at_hand.add<float>("x", shape, values);
  at_hand.add_mask("mask", shape, mask);
  at_hand.finish();
  made.add<float>("x", shape, [&](size_t first, std::span<float> out) {
    for (float& value : out) value = 0.5f * static_cast<float>(first++);
  });
  made.add_mask("mask", shape, [&](size_t first, std::span<uint8_t> out) {
    for (uint8_t& value : out) value = first++ % 3 == 0 ? 1 : 0;
  });
  made.finish();
  EXPECT_EQ(file_bytes(directory / "a.npz"), file_bytes(directory / "b.npz"));
  EXPECT_EQ(NpzReader(directory / "b.npz").read<float>("x"), values);
}

TEST(NpzWriter, WhatTheMakerOfValuesThrowsComesOutAndNothingIsWritten) {
  const TemporaryDirectory directory;
  NpzWriter writer(directory / "a.npz");
  writer.add<float>("x", {100000}, [](size_t first, std::span<float>) {
    if (first > 0) throw_error(ErrorCode::kDegenerate, "no more values");
  });
  EXPECT_ERROR(writer.finish(), ErrorCode::kDegenerate, "no more values");
  EXPECT_EQ(directory.num_files(), 0u);
}

TEST(NpzWriter, NumpyReadsWhatItWrites) {
  if (std::system("/usr/bin/python3 -c 'import numpy' 2>/dev/null") != 0) {
    GTEST_SKIP() << "needs python3-numpy";
  }
  const TemporaryDirectory directory;
  const std::vector<float> f{1.5f, -2, 3, 4, 5, 6};
  const std::vector<uint8_t> mask{0, 1};
  const std::vector<std::string> names{"a.png", "Straße"};
  NpzWriter writer(directory / "a.npz", NpzCompression::kDeflate);
  writer.add<float>("f", {2, 3}, f);
  writer.add_mask("mask", {2}, mask);
  writer.add_strings("names", names);
  writer.finish();
  const std::string command =
      "/usr/bin/python3 -c \"import numpy as n; z=n.load('" + (directory / "a.npz").string() +
      "'); assert z['f'].tolist()==[[1.5,-2,3],[4,5,6]] and z['f'].dtype=='<f4';"
      "assert z['mask'].tolist()==[False,True];"
      "assert z['names'].tolist()==['a.png','Stra\\u00dfe']\"";
  EXPECT_EQ(std::system(command.c_str()), 0);
}

TEST(NpzWriter, FailureIsAnOutputErrorAndLeavesNothing) {
  const std::vector<float> values(4);
  const TemporaryDirectory directory;
  const auto write = [&](const std::filesystem::path& path) {
    NpzWriter writer(path);
    writer.add<float>("x", {4}, values);
    writer.finish();
  };
  EXPECT_ERROR(write(directory / "no/such/a.npz"), ErrorCode::kOutput, "a.npz: cannot be written");
  EXPECT_ERROR(write(directory.path()), ErrorCode::kOutput, "Is a directory");
  {
    NpzWriter never_finished(directory / "b.npz");
    never_finished.add<float>("x", {4}, values);
  }
  EXPECT_EQ(directory.num_files(), 0u);
}

}  // namespace
}  // namespace vggtcd
