// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/weight_file.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "tests/support/test_files.h"
#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

// The error for a file of this content, which must be one line that names the file.
std::string error_of(const std::string& content) {
  const TemporaryDirectory directory;
  const std::string path = directory / "weights.bin";
  std::ofstream(path, std::ios::binary) << content;
  std::string what;
  try {
    open_weight_file(path);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kWeights);
    what = error.what();
  }
  EXPECT_TRUE(what.starts_with(path + ": ")) << what;
  EXPECT_EQ(what.find('\n'), std::string::npos) << what;
  return what;
}

ErrorCode code_of(const fs::path& path) {
  try {
    open_weight_file(path);
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr(path.string()));
    return error.code();
  }
  return ErrorCode::kInternal;
}

TEST(WeightFile, FailedDownloadsAreCalledWhatTheyAre) {
  EXPECT_THAT(error_of("<!DOCTYPE html>\n<html><body>404</body></html>"), HasSubstr("a web page"));
  EXPECT_THAT(error_of("\xef\xbb\xbf\n  <html>"), HasSubstr("a web page"));
  EXPECT_THAT(error_of("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 5\n"),
              HasSubstr("git lfs pull"));
  EXPECT_THAT(error_of("Access denied\n"), HasSubstr("found text"));
  EXPECT_THAT(error_of(R"({"error": "Repository not found"})"), HasSubstr("found text"));
  EXPECT_THAT(error_of(""), HasSubstr("an empty file"));
  EXPECT_THAT(error_of(std::string(100, '\0')), HasSubstr("found neither"));
  EXPECT_THAT(error_of("GGUF" + std::string(60, '\3')), HasSubstr("found neither"));
}

TEST(WeightFile, WhatCannotBeReadIsNamed) {
  EXPECT_EQ(code_of("/no/such/file"), ErrorCode::kWeights);
  EXPECT_EQ(code_of(::testing::TempDir()), ErrorCode::kWeights);
  const TemporaryDirectory directory;
  const std::string pipe = directory / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(code_of(pipe), ErrorCode::kWeights);  // and does not wait for a writer
}

}  // namespace
}  // namespace vggtcd
