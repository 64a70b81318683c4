// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/result_list.h"

#include <gtest/gtest.h>

#include "tests/support/test_files.h"

namespace vggtcd {
namespace {

namespace fs = std::filesystem;

uint64_t hash_of(std::string_view text) { return xxh64(std::as_bytes(std::span(text))); }

// The values of the reference implementation (xxh64sum).
TEST(FileHash, IsXxh64) {
  EXPECT_EQ(hash_of(""), 0xef46db3751d8e999u);
  EXPECT_EQ(hash_of("a"), 0xd24ec4f1a98c6e5bu);
  EXPECT_EQ(hash_of("abc"), 0x44bc2cf5ad770999u);
  EXPECT_EQ(hash_of("Nobody inspects the spammish repetition"), 0xfbcea83c8a378bf1u);
}

TEST(FileHash, OfAFileIsThatOfItsBytesAcrossTheBuffer) {
  const TemporaryDirectory directory;
  for (const size_t size : {0u, 1u, 31u, 32u, 100u, (1u << 20) - 1, 1u << 20, (1u << 20) + 37}) {
    std::string bytes(size, ' ');
    for (size_t i = 0; i < size; ++i) bytes[i] = static_cast<char>(i * i >> 3);
    write_bytes(directory / "file", bytes);
    EXPECT_EQ(stamp_of(directory / "file"), (FileStamp{size, hash_of(bytes)})) << size;
  }
}

TEST(FileHash, OnlyRegularFilesHaveOne) {
  const TemporaryDirectory directory;
  write_bytes(directory / "file", "x");
  fs::create_symlink("file", directory / "link");
  EXPECT_TRUE(stamp_of(directory / "file"));
  EXPECT_FALSE(stamp_of(directory / "link"));
  EXPECT_FALSE(stamp_of(directory / "none"));
  EXPECT_FALSE(stamp_of(directory.path()));
}

TEST(ResultList, ReadsBackNamesOfAnyBytes) {
  ResultList list("results");
  const std::vector<std::string> paths = {"a b.txt", "back\\slash", "caf\xe9.png", "folder/x",
                                          "line\nbreak"};
  for (const std::string& path : paths) list.add(path, {paths.size(), 7});
  const ResultList again = ResultList::parse(list.text(), "list");
  EXPECT_EQ(again.kind(), "results");
  EXPECT_EQ(again.paths(), paths);
  EXPECT_EQ(again.text(), list.text());
  EXPECT_EQ(list.text().substr(0, 49), "vggt-cd results 1\n0000000000000007 5 a b.txt\n0000");
}

TEST(ResultList, NothingIsListedInAnEmptyOneAndOneOfVersion010) {
  EXPECT_TRUE(ResultList::parse("", "list").empty());
  EXPECT_TRUE(
      ResultList::parse("Written by vggt-cd, which may replace this directory.\n", "list").empty());
}

TEST(ResultList, WhatIsCutOffOrLeadsElsewhereIsRefused) {
  const std::string head = "vggt-cd results 1\n";
  for (const std::string& text :
       {std::string("something else\n"), std::string("vggt-cd results 2\n"),
        std::string("vggt-cd 1\n"), std::string("vggt-cd results 1"), head + "12 5 a\n",
        head + "0000000000000007 x a\n", head + "0000000000000007 5 a", head + "0000000000000007\n",
        head + "0000000000000007 5 \n", head + "0000000000000007 5 /etc/passwd\n",
        head + "0000000000000007 5 ../a\n", head + "0000000000000007 5 a/../../b\n",
        head + "0000000000000007 5 a//b/\n", head + "0000000000000007 5 a\\b\n",
        head + "0000000000000007 5 a\\\n"}) {
    EXPECT_ERROR(ResultList::parse(text, "out/list"), ErrorCode::kOutput, "out/list: line ")
        << text;
  }
}

TEST(ResultList, OwnsWhatHasTheBytesThatWereListed) {
  const TemporaryDirectory directory;
  fs::create_directories(directory / "overlays");
  write_bytes(directory / "overlays/a.png", "first");
  ResultList list("results");
  list.add("overlays/a.png", *stamp_of(directory / "overlays/a.png"));
  EXPECT_TRUE(list.owns(directory.path(), "overlays/a.png"));
  write_bytes(directory / "overlays/b.png", "first");
  EXPECT_FALSE(list.owns(directory.path(), "overlays/b.png"));  // not listed
  write_bytes(directory / "overlays/a.png", "other");           // as long
  EXPECT_FALSE(list.owns(directory.path(), "overlays/a.png"));
  list.add("overlays/a.png", *stamp_of(directory / "overlays/a.png"));  // while it is replaced
  EXPECT_TRUE(list.owns(directory.path(), "overlays/a.png"));
  write_bytes(directory / "overlays/a.png", "first");
  EXPECT_TRUE(list.owns(directory.path(), "overlays/a.png"));
}

TEST(ResultList, OwnsNothingBehindALink) {
  const TemporaryDirectory directory;
  fs::create_directories(directory / "elsewhere");
  fs::create_directory(directory / "out");
  write_bytes(directory / "elsewhere/a.png", "bytes");
  ResultList list("results");
  list.add("overlays/a.png", *stamp_of(directory / "elsewhere/a.png"));
  list.add("a.png", *stamp_of(directory / "elsewhere/a.png"));
  fs::create_directory_symlink(directory / "elsewhere", directory / "out/overlays");
  fs::create_symlink(directory / "elsewhere/a.png", directory / "out/a.png");
  EXPECT_FALSE(list.owns(directory / "out", "overlays/a.png"));
  EXPECT_FALSE(list.owns(directory / "out", "a.png"));
}

}  // namespace
}  // namespace vggtcd
