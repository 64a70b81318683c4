// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/output_conflict.h"

#include <gtest/gtest.h>

#include "tests/support/test_files.h"

namespace vggtcd {
namespace {

namespace fs = std::filesystem;

class OutputConflict : public testing::Test {
 protected:
  OutputConflict() {
    fs::create_directories(directory_ / "site/before");
    fs::create_directories(directory_ / "photos");
    write_bytes(directory_ / "site/before/a.jpg", "photo");
    write_bytes(directory_ / "site/t1.npz", "arrays");
    write_bytes(directory_ / "photos/a.jpg", "photo");
  }
  std::string at(std::string_view name) const { return (directory_ / name).string(); }
  void refused(std::string_view out, const std::string& input, std::string_view words) const {
    EXPECT_ERROR(require_directory_apart(at(out), {"", input}), ErrorCode::kOutput, words)
        << out << " " << input;
  }
  void refused_file(std::string_view out, const std::string& input, std::string_view words) const {
    EXPECT_ERROR(require_file_apart(at(out), {"", input}), ErrorCode::kOutput, words)
        << out << " " << input;
  }
  const TemporaryDirectory directory_;
};

TEST_F(OutputConflict, ADirectoryHoldsIsOrLiesInAnInput) {
  refused("site", at("site/before"), "site: cannot be written: it holds the input ");
  refused("site", at("site/t1.npz"), "it holds the input ");
  refused("site", at("site/before/*.jpg"), "it holds the input ");
  refused("site/../site/", at("photos/../site/before/"), "it holds the input ");
  refused("photos", at("photos"), "it is the input ");
  refused("photos/new/out", at("photos"), "it lies in the input ");
  refused("photos/new/out", at("photos"), "name another directory, outside of it");
}

TEST_F(OutputConflict, BehindLinksToo) {
  fs::create_directory_symlink(directory_ / "site", directory_ / "link");
  refused("link", at("site/before"), "it holds the input ");
  refused("site", at("link/t1.npz"), "it holds the input ");
  refused("link/before/out", at("site/before"), "it lies in the input ");
  fs::create_directory(directory_ / "links");
  fs::create_symlink(directory_ / "site/before/a.jpg", directory_ / "links/a.jpg");
  refused("site", at("links"), "it holds the input " + at("links/a.jpg"));
  fs::create_symlink(directory_ / "photos/new", directory_ / "dangling");
  refused("dangling", at("photos"), "it lies in the input ");
}

TEST_F(OutputConflict, ADirectoryBesideInputsIsFree) {
  const std::vector<std::string> inputs = {at("site/before"), at("photos"),      at("photos/*.jpg"),
                                           at("site/t1.npz"), at("nowhere.npz"), ""};
  for (const char* out : {"out", "site/out", "photos2", "new/parents/out"}) {
    require_directory_apart(at(out), inputs);
  }
  require_directory_apart(at("photos/out"), {at("photos/*.jpg")});  // a new folder beside the files
}

TEST_F(OutputConflict, AFileIsMatchesOrLiesInAnInput) {
  refused_file("site/t1.npz", at("site/t1.npz"), "t1.npz: cannot be written: it is the input ");
  refused_file("photos/a.jpg", at("photos/*.jpg"), "it is the input ");
  refused_file("photos/a.jpg", at("photos"), "it lies in the input ");
  refused_file("photos/new.npz", at("photos"), "name another file, outside of it");
  fs::create_symlink(directory_ / "site/t1.npz", directory_ / "link.npz");
  fs::create_hard_link(directory_ / "site/t1.npz", directory_ / "twin.npz");
  refused_file("link.npz", at("site/t1.npz"), "it is the input ");
  refused_file("twin.npz", at("site/t1.npz"), "it is the input ");
  require_file_apart(at("out.npz"), {at("site/t1.npz"), at("photos"), at("photos/*.jpg")});
  require_file_apart(at("photos/out.npz"), {at("photos/*.jpg")});
  require_file_apart("", {at("photos")});
}

TEST_F(OutputConflict, AFileIsOneOfTheResultsThatAreRead) {
  write_bytes(directory_ / "site/.vggt-cd-results",
              "vggt-cd results 1\n0000000000000001 6 t1.npz\n0000000000000001 5 before/a.jpg\n");
  EXPECT_ERROR(require_no_result(at("site/t1.npz"), at("site")), ErrorCode::kOutput,
               "t1.npz: cannot be written: it is one of the results in ");
  EXPECT_ERROR(require_no_result(at("site/before/a.jpg"), at("site")), ErrorCode::kOutput,
               "it is one of the results");
  require_no_result(at("site/scores.json"), at("site"));
  require_no_result(at("photos/a.jpg"), at("site"));
  require_no_result("", at("site"));
}

}  // namespace
}  // namespace vggtcd
