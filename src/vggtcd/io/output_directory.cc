// SPDX-License-Identifier: Apache-2.0
// OutputDirectory: checks first, one rename last.
#include "vggtcd/io/output_directory.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <system_error>

#include "vggtcd/core/error.h"
#include "vggtcd/io/file_system.h"

namespace vggtcd {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(const fs::path& target, std::string_view reason) {
  throw_error(ErrorCode::kOutput, "{}: cannot be written: {}", target.string(), reason);
}

// The target without symbolic links, "." and final slashes, so that renaming means it.
fs::path resolve(const fs::path& target) {
  std::error_code error;
  if (target.empty()) fail(target, "no directory given");
  fs::path resolved = fs::absolute(target, error);
  if (!error) resolved = fs::weakly_canonical(resolved, error);
  if (error) fail(target, error.message());
  if (!resolved.has_filename()) resolved = resolved.parent_path();
  if (resolved == resolved.root_path() || resolved == fs::current_path(error)) {
    fail(target, "results need a directory of their own; name one that is not here yet");
  }
  return resolved;
}

void check_replaceable(const fs::path& target) {
  std::error_code error;
  const fs::file_status status = fs::status(target, error);
  if (!fs::exists(status)) return;
  if (!fs::is_directory(status)) fail(target, "is a file");
  const bool empty = fs::is_empty(target, error);
  if (error) fail(target, error.message());
  if (!empty && !exists_at(target / OutputDirectory::kMarker)) {
    fail(target, "is a directory that holds other files; name another one, or empty it");
  }
}

// Removes OUT.partial-PID of processes that are gone; what they had taken out of OUT goes back.
void remove_stale(const fs::path& target, const std::vector<std::string>& kept) {
  const std::string prefix = target.filename().string() + ".partial-";
  std::vector<fs::path> stale;
  std::error_code error;
  for (fs::directory_iterator entry(target.parent_path(), error);
       !error && entry != fs::directory_iterator(); entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (name.starts_with(prefix) && is_folder(entry->path())) stale.push_back(entry->path());
  }
  for (const fs::path& path : stale) {
    const auto lock =
        FileLock::try_lock(path / OutputDirectory::kMarker, FileLock::IfMissing::kGiveUp);
    if (!lock) continue;  // not ours, or its process lives
    for (const std::string& name : kept) {
      const bool taken = exists_at(path / name) && exists_at(target) && !exists_at(target / name);
      if (taken) fs::rename(path / name, target / name, error);
    }
    fs::remove_all(path, error);
  }
}

}  // namespace

OutputDirectory::OutputDirectory(const fs::path& target, std::vector<std::string> kept)
    : target_(resolve(target)), kept_(std::move(kept)) {
  check_replaceable(target_);
  remove_stale(target_, kept_);
  aside_ = target_;
  aside_ += fmt::format(".partial-{}", getpid());
  for (fs::path parent = target_.parent_path(); !exists_at(parent); parent = parent.parent_path()) {
    first_created_parent_ = parent;
  }
  std::error_code error;
  fs::remove_all(aside_, error);  // without a marker, of a process that had our number
  fs::create_directories(aside_, error);
  try {
    if (error) fail(target_, error.message());
    // Locked before it says anything: nobody takes this directory for a dead process's.
    lock_ = FileLock::try_lock(aside_ / kMarker);
    std::ofstream marker(aside_ / kMarker);
    marker << "Written by vggt-cd, which may replace this directory.\n";
    if (!lock_ || !marker.flush()) fail(target_, std::strerror(errno));
  } catch (...) {
    // A constructor that throws has no destructor.
    fs::remove_all(first_created_parent_.empty() ? aside_ : first_created_parent_, error);
    throw;
  }
}

OutputDirectory::~OutputDirectory() {
  if (committed_) return;
  std::error_code ignored;
  fs::remove_all(aside_, ignored);
  // Parents that were made for this, as long as nobody else uses them: rmdir takes empty ones only.
  if (first_created_parent_.empty()) return;
  for (fs::path parent = target_.parent_path(); rmdir(parent.c_str()) == 0;
       parent = parent.parent_path()) {
    if (parent == first_created_parent_) break;
  }
}

fs::path OutputDirectory::subdirectory(std::string_view name) const {
  const fs::path path = aside_ / name;
  std::error_code error;
  fs::create_directories(path, error);
  if (error) fail(target_, error.message());
  return path;
}

void OutputDirectory::commit() {
  check(!committed_, "OutputDirectory: committed twice");
  check_replaceable(target_);  // somebody may have put something there meanwhile
  std::error_code error;
  for (const std::string& name : kept_) {
    if (!exists_at(target_ / name)) continue;
    fs::rename(target_ / name, aside_ / name, error);
    if (error) fail(target_, error.message());
  }
  if (!exists_at(target_)) {
    fs::rename(aside_, target_, error);
    if (error) fail(target_, error.message());
    committed_ = true;
    return;
  }
  // Old and new change places in one step, so that there are complete results at any time.
  if (renameat2(AT_FDCWD, aside_.c_str(), AT_FDCWD, target_.c_str(), RENAME_EXCHANGE) != 0) {
    if (errno != EINVAL && errno != ENOSYS) fail(target_, std::strerror(errno));
    // A file system that cannot exchange: in two steps.
    fs::path old = aside_;
    old += ".old";
    fs::rename(target_, old, error);
    if (!error) fs::rename(aside_, target_, error);
    if (error) {
      const std::string reason = error.message();
      fs::rename(old, target_, error);
      fail(target_, reason);
    }
    fs::rename(old, aside_, error);
  }
  committed_ = true;
  fs::remove_all(aside_, error);  // the old results
}

}  // namespace vggtcd
