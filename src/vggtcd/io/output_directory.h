// SPDX-License-Identifier: Apache-2.0
// OutputDirectory: a directory of results that appears complete or not at all, and that replaces
// only what an earlier run wrote. docs/decisions/0009-what-a-result-directory-may-replace.md.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "vggtcd/io/file_lock.h"
#include "vggtcd/io/result_list.h"

namespace vggtcd {

// Of what detect, register and view write.
inline constexpr const char* kResultsKind = "results";

// Of what a benchmark keeps between runs.
inline constexpr const char* kCacheKind = "cache";

// What a command writes into its directory.
struct OutputContents {
  std::string kind;  // of the list: "results", "scene", ...; one kind never replaces another
  // The entries at the top, a final slash for directories. The first is put in place last: where
  // it is, all is.
  std::vector<std::string> names;
  bool adds = false;   // other files of earlier runs stay
  bool cache = false;  // a file that is listed may be replaced though it was damaged since
};

// Files are written aside and put in place by commit(). Where the target is not there, aside is
// beside it, under a name of its own, and the whole directory is renamed. Where it is there (it may
// be a mount point) aside is in it, and the files are moved one by one: every file that
// ResultList::kFile lists and that has not changed since is replaced or removed, anything else
// stays where it is. The target must be empty (but for hidden files) or hold such a list.
//
// A failure throws Error{kOutput} in one line, and leaves the target as it was and nothing beside
// it. What a killed process left the next OutputDirectory of that target removes: only what says of
// itself that it is that, and whose lock nobody holds.
class OutputDirectory {
 public:
  // Fails now, before any work is done, if the results could not be put in place later: the line
  // names what stands there. One process at a time writes into a directory that is there.
  OutputDirectory(const std::filesystem::path& target, OutputContents contents);
  ~OutputDirectory();  // without commit(): removes what was written
  OutputDirectory(const OutputDirectory&) = delete;
  OutputDirectory& operator=(const OutputDirectory&) = delete;

  // The same failures, but nothing is made or changed.
  static void check_usable(const std::filesystem::path& target, const OutputContents& contents);
  // Makes the directory, with a list, so that what is kept between runs may live in it.
  static void claim(const std::filesystem::path& target, const OutputContents& contents);

  // Where to write for now.
  const std::filesystem::path& path() const { return aside_; }
  std::filesystem::path operator/(std::string_view name) const { return aside_ / name; }
  // path() / name, created.
  std::filesystem::path subdirectory(std::string_view name) const;

  // Throws Error{kOutput} if something stands in the way that was not there before the work; the
  // results stay where they were written then, and the line says where.
  void commit();

 private:
  void lock_target();
  void make_aside();
  void put_in_place(const ResultList& written);
  void install_list(const ResultList& list);
  void give_up();
  [[noreturn]] void keep_aside(const std::string& reason);

  std::filesystem::path target_;
  OutputContents contents_;
  std::filesystem::path aside_;
  std::filesystem::path first_created_parent_;  // empty if all parents were there
  std::optional<FileLock> target_lock_;         // on the list of a target that is there
  std::optional<FileLock> aside_lock_;          // on the note in aside_
  ResultList list_{""};                         // of the target
  bool in_place_ = false;                       // the target is there, aside_ in it
  bool made_list_ = false;
  bool done_ = false;
};

}  // namespace vggtcd
