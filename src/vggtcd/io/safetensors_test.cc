// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/safetensors.h"

#include <gmock/gmock.h>

#include <bit>
#include <cstring>
#include <filesystem>

#include "tests/support/test_files.h"
#include "vggtcd/core/error.h"
#include "vggtcd/core/interrupt.h"

namespace vggtcd {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

// The bytes of a file with this header and data; `aligned` memory so that views can be aligned.
std::vector<std::byte> file_bytes(const std::string& header, const std::string& data) {
  std::vector<std::byte> bytes(8 + header.size() + data.size());
  const uint64_t length = header.size();
  std::memcpy(bytes.data(), &length, 8);
  std::memcpy(bytes.data() + 8, header.data(), header.size());
  std::memcpy(bytes.data() + 8 + header.size(), data.data(), data.size());
  return bytes;
}

std::string padded(std::string header) {
  header.append((8 - header.size() % 8) % 8, ' ');
  return header;
}

// The message of the one-line error, or "" if there was none.
std::string error_of(const std::vector<std::byte>& bytes) {
  try {
    parse_safetensors(bytes, "x.safetensors");
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kWeights);
    const std::string what = error.what();
    EXPECT_EQ(what.find('\n'), std::string::npos) << what;
    EXPECT_TRUE(what.starts_with("x.safetensors: ")) << what;
    return what;
  }
  return "";
}
std::string error_of(const std::string& header, const std::string& data) {
  return error_of(file_bytes(padded(header), data));
}

std::string entry(const std::string& name, const std::string& dtype, const std::string& shape,
                  int begin, int end) {
  return '"' + name + R"(": {"dtype": ")" + dtype + R"(", "shape": )" + shape +
         R"(, "data_offsets": [)" + std::to_string(begin) + ", " + std::to_string(end) + "]}";
}

TEST(Safetensors, ReadsTensorsInPlaceInFileOrder) {
  const std::string header = "{" + entry("second", "U8", "[2]", 12, 14) + "," +
                             R"("__metadata__": {"config": "{}"},)" +
                             entry("first", "F32", "[1, 3]", 0, 12) + "}";
  const float values[3] = {1.0f, -2.5f, 3.0f};
  std::string data(reinterpret_cast<const char*>(values), 12);
  data += "\x07\x09";
  const std::vector<std::byte> bytes = file_bytes(padded(header), data);
  const WeightFile file = parse_safetensors(bytes, "x");
  ASSERT_EQ(file.tensors.size(), 2u);
  EXPECT_EQ(file.tensors[0].name, "first");
  EXPECT_EQ(file.tensors[0].dtype, DType::kF32);
  EXPECT_EQ(file.tensors[0].shape, (std::vector<int64_t>{1, 3}));
  EXPECT_EQ(std::memcmp(file.tensors[0].data.data(), values, 12), 0);
  EXPECT_EQ(file.tensors[0].data.data(), bytes.data() + bytes.size() - 14);  // a view, no copy
  EXPECT_EQ(file.tensors[1].data[1], std::byte{9});
  EXPECT_EQ(file.metadata.at("config"), "{}");
  EXPECT_EQ(file.find("second"), &file.tensors[1]);
  EXPECT_EQ(file.find("third"), nullptr);
}

TEST(Safetensors, ReadsEveryTypeScalarsAndEmptyTensors) {
  const std::pair<const char*, int> types[] = {{"F64", 8}, {"I64", 8},  {"F32", 4}, {"I32", 4},
                                               {"F16", 2}, {"BF16", 2}, {"I16", 2}, {"I8", 1},
                                               {"U8", 1},  {"BOOL", 1}};
  std::string header = "{" + entry("empty", "F32", "[0, 3]", 0, 0);
  int at = 0;
  for (const auto& [type, size] : types) {
    header += "," + entry(type, type, "[]", at, at + size);
    at += size;
  }
  const std::vector<std::byte> bytes =
      file_bytes(padded(header + "}"), std::string(static_cast<size_t>(at), 'x'));
  const WeightFile file = parse_safetensors(bytes, "x");
  EXPECT_EQ(file.tensors.size(), 11u);
  for (const auto& [type, size] : types) {
    ASSERT_NE(file.find(type), nullptr);
    EXPECT_EQ(dtype_size(file.find(type)->dtype), static_cast<size_t>(size)) << type;
    EXPECT_EQ(file.find(type)->numel(), 1);
  }
  EXPECT_EQ(file.find("empty")->numel(), 0);
}

TEST(Safetensors, RefusesTruncatedFiles) {
  const std::vector<std::byte> whole =
      file_bytes(padded("{" + entry("a", "F32", "[2]", 0, 8) + "}"), "12345678");
  EXPECT_EQ(error_of(whole), "");
  for (size_t size = 0; size < whole.size(); ++size) {
    EXPECT_NE(error_of({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)}), "")
        << size;
  }
}

TEST(Safetensors, RefusesAbsurdHeaderLengths) {
  for (const uint64_t length : {~uint64_t{0}, uint64_t{1} << 63, uint64_t{100'000'001}}) {
    std::vector<std::byte> bytes = file_bytes("{}", "");
    std::memcpy(bytes.data(), &length, 8);
    EXPECT_THAT(error_of(bytes), HasSubstr("at most 100000000 bytes"));
  }
  std::vector<std::byte> bytes = file_bytes("{}", "");
  bytes[0] = std::byte{200};
  EXPECT_THAT(error_of(bytes), HasSubstr("header of 200 bytes"));
}

TEST(Safetensors, RefusesHeadersThatAreNotItsJson) {
  EXPECT_THAT(error_of("[1, 2]", ""), HasSubstr("brace"));
  EXPECT_THAT(error_of("{\"a\": ", ""), HasSubstr("not valid JSON"));
  EXPECT_THAT(error_of("{\"\xff\": 1}", ""), HasSubstr("not valid JSON"));  // not UTF-8
  EXPECT_THAT(error_of(R"({"a": 1})", ""), HasSubstr("has no dtype"));
  EXPECT_THAT(error_of(R"({"a": 1e999})", ""), HasSubstr("out of range"));
  EXPECT_THAT(error_of(R"({"__metadata__": {"a": 1}})", ""), HasSubstr("not a string"));
  EXPECT_THAT(error_of(R"({"a": {"dtype": "F32", "shape": [1]}})", ""),
              HasSubstr("has no data_offsets"));
  EXPECT_THAT(error_of("{\"a\": " + std::string(100'000, '['), ""), HasSubstr("too deeply"));
}

TEST(Safetensors, RefusesTypesShapesAndOffsetsThatLie) {
  EXPECT_THAT(error_of("{" + entry("a", "F33", "[1]", 0, 4) + "}", "1234"), HasSubstr("\"F33\""));
  EXPECT_THAT(error_of("{" + entry("a", "F32", "[2]", 0, 4) + "}", "1234"), HasSubstr("8 bytes"));
  EXPECT_THAT(error_of("{" + entry("a", "F32", "[-1]", 0, 4) + "}", "1234"), HasSubstr("shape"));
  EXPECT_THAT(error_of("{" + entry("a", "F32", "[1.0]", 0, 4) + "}", "1234"), HasSubstr("shape"));
  EXPECT_THAT(error_of("{" + entry("a", "F32", "[4294967296, 4294967296]", 0, 0) + "}", ""),
              HasSubstr("absurd"));
  EXPECT_THAT(error_of("{" + entry("a", "F32", "[1]", 4, 0) + "}", "1234"), HasSubstr("[begin"));
  EXPECT_THAT(error_of("{" + entry("a", "F32", "[2]", 0, 8) + "}", "1234"),
              HasSubstr("ends at byte 8"));
}

TEST(Safetensors, RefusesOverlapsGapsAndLeftovers) {
  EXPECT_THAT(
      error_of("{" + entry("a", "U8", "[4]", 0, 4) + "," + entry("b", "U8", "[4]", 2, 6) + "}",
               "123456"),
      HasSubstr("tensor \"b\" overlaps"));
  EXPECT_THAT(
      error_of("{" + entry("a", "U8", "[2]", 0, 2) + "," + entry("b", "U8", "[2]", 4, 6) + "}",
               "123456"),
      HasSubstr("2 bytes before tensor \"b\""));
  EXPECT_THAT(error_of("{" + entry("a", "U8", "[2]", 0, 2) + "}", "123456"),
              HasSubstr("4 bytes after the last tensor"));
}

TEST(Safetensors, RefusesMisalignedTensors) {
  EXPECT_THAT(
      error_of("{" + entry("a", "U8", "[2]", 0, 2) + "," + entry("b", "F32", "[1]", 2, 6) + "}",
               "123456"),
      HasSubstr("not aligned"));
}

TEST(Safetensors, RefusesNamesThatAreThereTwice) {
  EXPECT_THAT(
      error_of("{" + entry("a", "U8", "[2]", 0, 2) + "," + entry("a", "U8", "[2]", 2, 4) + "}",
               "1234"),
      HasSubstr("names \"a\" twice"));
  EXPECT_THAT(error_of(R"({"a": {"dtype": "U8", "dtype": "U8", "shape": [0]}})", ""),
              HasSubstr("names \"dtype\" twice"));
}

TEST(Safetensors, HostileNamesDoNotBreakTheLine) {
  const std::string message = error_of(R"({"a\n\u001b[31m": 1})", "");
  EXPECT_THAT(message, HasSubstr(R"("a\x0a\x1b[31m")"));
  EXPECT_LT(error_of("{\"" + std::string(5000, 'n') + "\": 1}", "").size(), 300u);
}

class SafetensorsWriter : public ::testing::Test {
 protected:
  const TemporaryDirectory directory_;
};

TEST_F(SafetensorsWriter, WhatIsWrittenIsReadAgain) {
  const fs::path path = directory_ / "out.safetensors";
  const std::vector<TensorInfo> infos = {{"byte", DType::kU8, {3}},
                                         {"half", DType::kF16, {2, 2}},
                                         {"wide", DType::kF64, {1}},
                                         {"none", DType::kF32, {0}}};
  write_safetensors(path, infos, {{"config", "{\"a\": \"\xc3\xa4\"}"}},
                    [](size_t i, std::span<std::byte> data) {
                      std::ranges::fill(data, static_cast<std::byte>(i + 1));
                    });
  const WeightFile file = open_weight_file(path);
  EXPECT_EQ(file.format, WeightFormat::kSafetensors);
  EXPECT_EQ(file.metadata.at("config"), "{\"a\": \"\xc3\xa4\"}");
  ASSERT_EQ(file.tensors.size(), infos.size());
  for (size_t i = 0; i < infos.size(); ++i) {
    const TensorView* tensor = file.find(infos[i].name);
    ASSERT_NE(tensor, nullptr);
    EXPECT_EQ(tensor->dtype, infos[i].dtype);
    EXPECT_EQ(tensor->shape, infos[i].shape);
    for (const std::byte byte : tensor->data) EXPECT_EQ(byte, static_cast<std::byte>(i + 1));
  }
}

TEST_F(SafetensorsWriter, ANameThatIsNotUtf8IsShownEscaped) {
  const std::vector<TensorInfo> infos = {{"head.\xff\xfe.weight", DType::kF32, {1}}};
  EXPECT_ERROR(write_safetensors(directory_ / "out", infos, {}, {}), ErrorCode::kWeights,
               R"(tensor "head.\xff\xfe.weight": expected a name in UTF-8)");
  EXPECT_EQ(directory_.num_files(), 0u);
}

TEST_F(SafetensorsWriter, FailureLeavesNothingBehind) {
  const std::vector<TensorInfo> infos = {{"a", DType::kF32, {1}}};
  const auto fail = [](size_t, std::span<std::byte>) {
    throw_error(ErrorCode::kWeights, "no values");
  };
  EXPECT_THROW(write_safetensors(directory_ / "out", infos, {}, fail), Error);
  EXPECT_EQ(directory_.num_files(), 0u);
}

TEST_F(SafetensorsWriter, InterruptLeavesNothingBehind) {
  const std::vector<TensorInfo> infos = {{"a", DType::kF32, {1}}, {"b", DType::kF32, {1}}};
  const auto interrupt = [](size_t, std::span<std::byte>) { request_interrupt(); };
  EXPECT_THROW(write_safetensors(directory_ / "out", infos, {}, interrupt), Error);
  clear_interrupt();
  EXPECT_EQ(directory_.num_files(), 0u);
}

TEST_F(SafetensorsWriter, UnwritablePathIsNamed) {
  try {
    write_safetensors(directory_ / "no/out", {}, {}, {});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kOutput);
    EXPECT_THAT(error.what(), HasSubstr("no/out"));
  }
}

}  // namespace
}  // namespace vggtcd
