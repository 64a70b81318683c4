// SPDX-License-Identifier: Apache-2.0
// OutputDirectory: checks first; one rename last, or a move per file under a list that knows both
// the old files and the new ones.
#include "vggtcd/io/output_directory.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <system_error>

#include "vggtcd/core/error.h"
#include "vggtcd/io/output_file.h"
#include "vggtcd/io/output_path.h"
#include "vggtcd/io/partial_directory.h"

namespace vggtcd {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& target, std::string_view reason) {
  throw_error(ErrorCode::kOutput, "{}: cannot be written: {}", target.string(), reason);
}

fs::path resolve(const fs::path& target) {
  if (target.empty()) fail(target, "no directory given");
  const fs::path resolved = resolve_output(target);
  std::error_code error;
  if (resolved == resolved.root_path() || resolved == fs::current_path(error)) {
    fail(target, "results need a directory of their own; name one that is not here yet");
  }
  return resolved;
}

fs::file_type type_of(const fs::path& path) {
  std::error_code error;
  return fs::symlink_status(path, error).type();
}

bool is_there(const fs::path& path) { return type_of(path) != fs::file_type::not_found; }

// An entry of a directory that is not ours and speaks against writing into it; empty if there is
// none. Hidden entries do not (.DS_Store, .gitkeep), and what a file system has at its root.
std::string foreign_entry(const fs::path& target) {
  std::error_code error;
  std::string found;
  auto entry = fs::directory_iterator(target, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (name.front() == '.' || name == "lost+found") continue;
    if (found.empty() || name < found) found = name;
  }
  if (error) fail(target, error.message());
  return found;
}

bool replaceable(const fs::path& target, const ResultList& list, const std::string& path,
                 const OutputContents& contents) {
  if (!contents.cache) return list.owns(target, path);
  return list.lists(path) && type_of(target / path) == fs::file_type::regular;
}

// What stands where `name` goes and may not be replaced; empty if nothing does.
std::string blocking(const fs::path& target, const ResultList& list, const std::string& name,
                     const OutputContents& contents) {
  const bool is_directory = name.ends_with('/');
  const std::string path = is_directory ? name.substr(0, name.size() - 1) : name;
  const fs::file_type type = type_of(target / path);
  if (type == fs::file_type::not_found) return {};
  if (!is_directory) return replaceable(target, list, path, contents) ? "" : path;
  if (type != fs::file_type::directory) return path;
  for (const std::string& listed : list.paths()) {
    if (!listed.starts_with(name) || !is_there(target / listed)) continue;
    if (!replaceable(target, list, listed, contents)) return listed;
  }
  return {};
}

// Directories of an earlier run, of another user perhaps, into which files will be moved.
void require_writable(const fs::path& target, const ResultList& list) {
  for (const std::string& listed : list.paths()) {
    const fs::path directory = (target / listed).parent_path();
    if (access(directory.c_str(), W_OK | X_OK) != 0 && errno != ENOENT) {
      fail(directory, std::strerror(errno));
    }
  }
}

// A directory is there, or may be made; it holds nothing, or something of ours.
void require_ours(const fs::path& target) {
  const fs::file_type type = type_of(target);
  if (type == fs::file_type::not_found) return;
  if (type != fs::file_type::directory) fail(target, "is a file");
  if (is_there(target / ResultList::kFile)) return;
  if (const std::string name = foreign_entry(target); !name.empty()) {
    fail(target, fmt::format("is a directory that holds other files, such as {}; name another one, "
                             "or empty it",
                             name));
  }
}

// The target's list, if these results can be put in place there.
ResultList usable_list(const fs::path& target, const OutputContents& contents) {
  const fs::path file = target / ResultList::kFile;
  if (!is_there(file)) return ResultList("");
  ResultList list = ResultList::read(file);
  if (!list.empty() && list.kind() != contents.kind) {
    fail(target, fmt::format("it holds what vggt-cd lists there as \"{}\", expected \"{}\"; name "
                             "another directory, or remove this one",
                             list.kind(), contents.kind));
  }
  for (const std::string& name : contents.names) {
    const std::string path = blocking(target, list, name, contents);
    if (path.empty()) continue;
    throw_error(ErrorCode::kOutput,
                "{}: stands where results go, and is not as vggt-cd wrote it there; move it away, "
                "or name another directory",
                (target / path).string());
  }
  require_writable(target, list);
  return list;
}

ResultList list_of(const fs::path& directory, const std::string& kind) {
  ResultList list(kind);
  for (const std::string& path : files_below(directory)) {
    if (path == ResultList::kFile || path == PartialDirectory::kNote) continue;
    const auto stamp = stamp_of(directory / path);
    if (!stamp) fail(directory / path, "it cannot be read again");
    list.add(path, *stamp);
  }
  return list;
}

// Removes the file, and directories that are empty without it.
void remove_listed(const fs::path& target, const std::string& path) {
  unlink((target / path).c_str());
  for (fs::path parent = fs::path(path).parent_path(); !parent.empty();
       parent = parent.parent_path()) {
    if (rmdir((target / parent).c_str()) != 0) break;
  }
}

// Empty if the lock is there. FileLock's errno.
std::string why_not_locked(const std::optional<FileLock>& lock) {
  if (lock) return {};
  if (errno != EWOULDBLOCK) return std::strerror(errno);
  return "another vggt-cd is working there; wait for it, or name another directory";
}

// Parents that were made for the target, as long as nobody else uses them: rmdir takes empty ones.
void remove_parents(const fs::path& target, const fs::path& first_created) {
  if (first_created.empty()) return;
  for (fs::path parent = target.parent_path(); rmdir(parent.c_str()) == 0;
       parent = parent.parent_path()) {
    if (parent == first_created) break;
  }
}

}  // namespace

void OutputDirectory::check_usable(const fs::path& target, const OutputContents& contents) {
  const fs::path directory = resolve(target);
  require_ours(directory);
  usable_list(directory, contents);
}

void OutputDirectory::claim(const fs::path& target, const OutputContents& contents) {
  check_usable(target, contents);
  const fs::path directory = resolve(target);
  std::error_code error;
  fs::create_directories(directory, error);
  if (error) fail(directory, error.message());
  const auto lock = FileLock::try_lock(directory / ResultList::kFile);
  if (const std::string reason = why_not_locked(lock); !reason.empty()) fail(directory, reason);
}

OutputDirectory::OutputDirectory(const fs::path& target, OutputContents contents)
    : target_(resolve(target)), contents_(std::move(contents)) {
  check(!contents_.names.empty(), "OutputDirectory: names of what is written");
  require_ours(target_);
  in_place_ = is_there(target_);
  try {
    if (in_place_) lock_target();
    make_aside();
  } catch (...) {
    give_up();  // a constructor that throws has no destructor
    throw;
  }
}

void OutputDirectory::lock_target() {
  const fs::path file = target_ / ResultList::kFile;
  made_list_ = !is_there(file);
  target_lock_ = FileLock::try_lock(file);
  if (const std::string reason = why_not_locked(target_lock_); !reason.empty()) {
    made_list_ = false;
    fail(target_, reason);
  }
  list_ = usable_list(target_, contents_);  // nobody changes it from now on
}

void OutputDirectory::make_aside() {
  std::error_code error;
  for (fs::path parent = target_.parent_path(); !fs::exists(parent, error);
       parent = parent.parent_path()) {
    first_created_parent_ = parent;
  }
  fs::create_directories(target_.parent_path(), error);
  if (error) fail(target_, error.message());
  PartialDirectory::remove_stale_beside(target_);
  if (in_place_) PartialDirectory::remove_stale_in(target_);
  PartialDirectory made = in_place_ ? PartialDirectory::make_in(target_, contents_.names)
                                    : PartialDirectory::make_beside(target_, contents_.names);
  aside_ = std::move(made.path);
  aside_lock_ = std::move(made.lock);
}

void OutputDirectory::give_up() {
  std::error_code ignored;
  if (!aside_.empty()) fs::remove_all(aside_, ignored);
  if (made_list_) unlink((target_ / ResultList::kFile).c_str());
  remove_parents(target_, first_created_parent_);
}

OutputDirectory::~OutputDirectory() {
  if (!done_) give_up();
}

fs::path OutputDirectory::subdirectory(std::string_view name) const {
  const fs::path path = aside_ / name;
  std::error_code error;
  fs::create_directories(path, error);
  if (error) fail(target_, error.message());
  return path;
}

void OutputDirectory::keep_aside(const std::string& reason) {
  done_ = true;
  unlink((aside_ / PartialDirectory::kNote).c_str());  // from now on it is nobody's to remove
  throw_error(ErrorCode::kOutput, "{}; the new results are complete in {}", reason,
              aside_.string());
}

void OutputDirectory::install_list(const ResultList& list) {
  const fs::path next = aside_ / fmt::format("{}.next", ResultList::kFile);
  write_text_file(next, list.text());
  // Locked before it has the name that others lock.
  std::optional<FileLock> lock = FileLock::try_lock(next);
  if (!lock || std::rename(next.c_str(), (target_ / ResultList::kFile).c_str()) != 0) {
    fail(target_, std::strerror(errno));
  }
  target_lock_ = std::move(lock);
  made_list_ = false;  // it stays, whatever happens now
}

void OutputDirectory::put_in_place(const ResultList& written) {
  const std::vector<std::string> new_paths = written.paths();
  for (const std::string& path : new_paths) {
    const bool free = reached_through_directories(target_, path) &&
                      (!is_there(target_ / path) || replaceable(target_, list_, path, contents_));
    if (!free) {
      keep_aside(fmt::format("{}: stands where results go, and vggt-cd did not write it",
                             (target_ / path).string()));
    }
  }
  std::vector<std::string> old_paths;
  for (const std::string& path : list_.paths()) {
    const bool old = !contents_.adds && !written.lists(path) && list_.owns(target_, path);
    if (old) old_paths.push_back(path);
  }
  std::error_code error;
  for (const std::string& path : new_paths) {
    fs::create_directories((target_ / path).parent_path(), error);
    if (error) fail(target_ / path, error.message());
  }
  const auto move = [&](const std::string& path) {
    if (std::rename((aside_ / path).c_str(), (target_ / path).c_str()) != 0) {
      fail(target_ / path, std::strerror(errno));
    }
  };
  // Whenever this is killed, the list knows every file of ours that is there.
  ResultList both = written;
  both.add(list_);
  install_list(both);
  const std::string& last = contents_.names.front();
  if (!contents_.adds && written.lists(last)) unlink((target_ / last).c_str());
  for (const std::string& path : new_paths) {
    if (path != last) move(path);
  }
  for (const std::string& path : old_paths) remove_listed(target_, path);
  if (written.lists(last)) move(last);
  ResultList now = written;
  if (contents_.adds) {
    for (const std::string& path : new_paths) list_.remove(path);
    now.add(list_);
  }
  install_list(now);
}

void OutputDirectory::commit() {
  check(!done_, "OutputDirectory: committed twice");
  const ResultList written = list_of(aside_, contents_.kind);
  write_text_file(aside_ / ResultList::kFile, written.text());
  if (!in_place_) {
    if (std::rename(aside_.c_str(), target_.c_str()) == 0) {
      done_ = true;
      unlink((target_ / PartialDirectory::kNote).c_str());
      return;
    }
    if (!is_there(target_)) fail(target_, std::strerror(errno));
    try {  // somebody has made it meanwhile
      require_ours(target_);
      lock_target();
    } catch (const Error& error) {
      keep_aside(error.what());
    }
  }
  put_in_place(written);
  done_ = true;
  std::error_code ignored;
  fs::remove_all(aside_, ignored);
}

}  // namespace vggtcd
