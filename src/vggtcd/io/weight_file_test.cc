// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/weight_file.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>

#include "tests/support/test_files.h"
#include "vggtcd/core/error.h"
#include "vggtcd/io/safetensors.h"
#include "vggtcd/io/weight_shards.h"

namespace vggtcd {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::UnorderedElementsAre;
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
  const TemporaryDirectory directory;
  EXPECT_EQ(code_of(directory.path()), ErrorCode::kWeights);
  const std::string pipe = directory / "pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_EQ(code_of(pipe), ErrorCode::kWeights);  // and does not wait for a writer
}

// A file of one f32 for each name; its value is the number of the name's letters.
void write_weights(const fs::path& path, const std::vector<std::string>& names) {
  std::vector<TensorInfo> infos;
  for (const std::string& name : names) infos.push_back({name, DType::kF32, {1}});
  write_safetensors(path, infos, {}, [&](size_t i, std::span<std::byte> data) {
    const float value = static_cast<float>(names[i].size());
    std::memcpy(data.data(), &value, sizeof(value));
  });
}

std::vector<std::string> names_of(const WeightFile& file) {
  std::vector<std::string> names;
  for (const TensorView& tensor : file.tensors) names.push_back(tensor.name);
  return names;
}

std::vector<std::string> names_read(const std::vector<std::string>& written) {
  const TemporaryDirectory directory;
  write_weights(directory / "a", written);
  return names_of(open_weight_file(directory / "a"));
}

TEST(WeightFile, WhatWrappersPutBeforeEveryNameIsTakenAway) {
  EXPECT_THAT(names_read({"module.a.weight", "module.b"}), ElementsAre("a.weight", "b"));
  EXPECT_THAT(names_read({"module._orig_mod.a", "module._orig_mod.b"}), ElementsAre("a", "b"));
  EXPECT_THAT(names_read({"_orig_mod.model.a", "_orig_mod.model.b"}), ElementsAre("a", "b"));
  EXPECT_THAT(names_read({"a._orig_mod.x", "b.c._orig_mod.d._orig_mod.y"}),
              ElementsAre("a.x", "b.c.d.y"));
  // Not every name: then it is a name.
  EXPECT_THAT(names_read({"module.a", "b"}), ElementsAre("module.a", "b"));
  EXPECT_THAT(names_read({"modules.a", "modules.b"}), ElementsAre("modules.a", "modules.b"));
  EXPECT_THAT(names_read({"module.", "module.a"}), ElementsAre("module.", "module.a"));
  const TemporaryDirectory directory;
  write_weights(directory / "a", {"module.model.x"});
  EXPECT_EQ(open_weight_file(directory / "a").removed_prefix, "module.model.");
}

constexpr const char* kIndex = R"({"metadata": {"total_size": 12},
  "weight_map": {"a": "m-00001-of-00002.safetensors", "bb": "m-00002-of-00002.safetensors",
                 "ccc": "m-00001-of-00002.safetensors"}})";

// A folder with an index and the shards of kIndex.
struct Sharded {
  TemporaryDirectory directory{};
  fs::path index = directory / "model.safetensors.index.json";
  Sharded() {
    write_bytes(index, kIndex);
    write_weights(directory / "m-00001-of-00002.safetensors", {"a", "ccc"});
    write_weights(directory / "m-00002-of-00002.safetensors", {"bb"});
  }
};

TEST(WeightFile, AnIndexOrItsFolderIsOneCheckpoint) {
  const Sharded f;
  for (const fs::path& path : {f.index, f.directory.path()}) {
    const WeightFile file = open_weight_file(path);
    EXPECT_THAT(names_of(file), UnorderedElementsAre("a", "bb", "ccc"));
    for (const TensorView& tensor : file.tensors) {
      float value = 0;
      std::memcpy(&value, tensor.data.data(), sizeof(value));
      EXPECT_EQ(value, static_cast<float>(tensor.name.size())) << tensor.name;
    }
    EXPECT_EQ(weight_files(path).size(), 3u);
  }
  write_weights(f.directory / "model.safetensors", {"whole"});
  EXPECT_THAT(names_of(open_weight_file(f.directory.path())), ElementsAre("whole"));
}

TEST(WeightFile, AShardIsNotTakenForTheWhole) {
  const Sharded f;
  EXPECT_ERROR(open_weight_file(f.directory / "m-00001-of-00002.safetensors"), ErrorCode::kWeights,
               "found one of 2 shards; name the folder, or the index");
  write_weights(f.directory / "x-00001-of-00001.safetensors", {"a"});
  EXPECT_THAT(names_of(open_weight_file(f.directory / "x-00001-of-00001.safetensors")),
              ElementsAre("a"));
}

TEST(WeightFile, ShardsThatAreNotWhatTheIndexSaysAreNamed) {
  const auto expect = [](const auto& damage, std::string_view part) {
    const Sharded f;
    damage(f);
    EXPECT_ERROR(open_weight_file(f.index), ErrorCode::kWeights, part);
  };
  const auto index = [](std::string_view text) {
    return [text](const Sharded& f) { write_bytes(f.index, text); };
  };
  expect([](const Sharded& f) { fs::remove(f.directory / "m-00002-of-00002.safetensors"); },
         "expected its shard \"m-00002-of-00002.safetensors\" beside it, found none");
  expect(
      [](const Sharded& f) { write_weights(f.directory / "m-00002-of-00002.safetensors", {"d"}); },
      "expected tensor \"bb\" as model.safetensors.index.json says");
  expect(
      [](const Sharded& f) {
        write_weights(f.directory / "m-00002-of-00002.safetensors", {"a", "bb"});
      },
      "tensor \"a\" is in another shard, too");
  expect(index(R"({"weight_map": {"a": "../a.safetensors"}})"), "a file beside the index");
  expect(index(R"({"weight_map": {"a": 7}})"), "a file beside the index");
  expect(index(R"({"weight_map": {}})"), "found text");
  expect(index(R"({"weight_map": {"a": )"), "found text");
}

TEST(WeightFile, TimeGrowsWithTheNumberOfTensorsNotWithItsSquare) {
  const TemporaryDirectory directory;
  const auto ticks_for = [&](int count) {
    std::vector<TensorInfo> infos;
    for (int i = 0; i < count; ++i) infos.push_back({"t" + std::to_string(i), DType::kF32, {0}});
    const std::clock_t start = std::clock();  // of the processor: other programs do not count
    write_safetensors(directory / "many", infos, {}, [](size_t, std::span<std::byte>) {});
    EXPECT_EQ(open_weight_file(directory / "many").tensors.size(), infos.size());
    return static_cast<double>(std::clock() - start);
  };
  // Sixteen times as many: 256 times as long with a search through all of them, which took minutes.
  const double few = ticks_for(2000), many = ticks_for(32000);
  EXPECT_LT(many, 100 * few);
}

}  // namespace
}  // namespace vggtcd
