// SPDX-License-Identifier: Apache-2.0
// PartialDirectory: a note that is locked, and read before anything is removed.
#include "vggtcd/io/partial_directory.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>

#include "vggtcd/core/error.h"
#include "vggtcd/io/file_system.h"
#include "vggtcd/io/input_file.h"
#include "vggtcd/io/output_path.h"
#include "vggtcd/io/result_list.h"

namespace vggtcd {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kFirstLine = "vggt-cd is writing here; what it left may be removed.";

[[noreturn]] void fail(const fs::path& target) {
  throw_error(ErrorCode::kOutput, "{}: cannot be written: {}", target.string(),
              std::strerror(errno));
}

fs::path prefix_in(const fs::path& target) {
  return target / fmt::format("{}-", PartialDirectory::kNote);
}

fs::path prefix_beside(const fs::path& target) {
  return target.parent_path() / partial_prefix(target.filename().string());
}

std::vector<std::string> lines_of(const fs::path& file) {
  std::vector<std::string> lines;
  if (!is_file(file)) return lines;
  InputFile in(file, "a note of vggt-cd");
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

void write_note(const fs::path& directory, const std::vector<std::string>& names) {
  std::ofstream out(directory / PartialDirectory::kNote);
  out << kFirstLine << '\n' << directory.filename().string() << '\n';
  for (const std::string& name : names) {
    out << name.substr(0, name.size() - (name.ends_with('/') ? 1 : 0)) << '\n';
  }
  if (!out.flush()) throw_error(ErrorCode::kOutput, "{}: cannot be written", directory.string());
}

PartialDirectory make(const fs::path& prefix, const fs::path& target,
                      const std::vector<std::string>& names) {
  // Another process may take a directory whose note is not locked yet for a dead one's: try again.
  constexpr int kTries = 100;
  for (int i = 0; i < kTries; ++i) {
    const fs::path path = make_unique(
        prefix, [](const fs::path& candidate) { return mkdir(candidate.c_str(), 0777) == 0; });
    if (path.empty()) fail(target);
    std::optional<FileLock> lock = FileLock::try_lock(path / PartialDirectory::kNote);
    const int error = errno;
    try {
      if (lock) {
        write_note(path, names);
        return {path, std::move(*lock)};
      }
    } catch (...) {
      std::error_code ignored;
      fs::remove_all(path, ignored);
      throw;
    }
    unlink((path / PartialDirectory::kNote).c_str());
    rmdir(path.c_str());
    errno = error;
    if (error != EWOULDBLOCK && error != ENOENT) break;
  }
  fail(target);
}

// Files being written have the name of what they become, and something behind it.
bool names_all_of(const std::vector<std::string>& names, const fs::path& directory) {
  std::error_code error;
  auto entry = fs::directory_iterator(directory, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    const bool known = name == PartialDirectory::kNote || name.starts_with(ResultList::kFile) ||
                       name.starts_with(".scratch-") ||
                       std::ranges::any_of(names, [&](const std::string& written) {
                         return name.starts_with(written);
                       });
    if (!known) return false;
  }
  return !error;
}

void remove_if_stale(const fs::path& directory) {
  const fs::path note = directory / PartialDirectory::kNote;
  const auto lock = FileLock::try_lock(note, FileLock::IfMissing::kGiveUp);
  if (!lock) return;  // not ours, or its process lives
  std::vector<std::string> names = lines_of(note);
  if (names.size() >= 2) {
    if (names[0] != kFirstLine || names[1] != directory.filename().string()) return;
    names.erase(names.begin(), names.begin() + 2);
  } else {
    names.clear();  // killed while it wrote the note: nothing else is there
  }
  if (!names_all_of(names, directory)) return;
  std::error_code ignored;
  fs::remove_all(directory, ignored);
}

std::vector<fs::path> directories_with(const fs::path& prefix) {
  std::vector<fs::path> found;
  std::error_code error;
  auto entry = fs::directory_iterator(prefix.parent_path(), error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    std::error_code ignored;
    const bool is_directory = entry->symlink_status(ignored).type() == fs::file_type::directory;
    const bool has_prefix =
        entry->path().filename().string().starts_with(prefix.filename().string());
    if (is_directory && has_prefix) found.push_back(entry->path());
  }
  return found;
}

}  // namespace

PartialDirectory PartialDirectory::make_beside(const fs::path& target,
                                               const std::vector<std::string>& names) {
  return make(prefix_beside(target), target, names);
}

PartialDirectory PartialDirectory::make_in(const fs::path& target,
                                           const std::vector<std::string>& names) {
  return make(prefix_in(target), target, names);
}

void PartialDirectory::remove_stale_beside(const fs::path& target) {
  for (const fs::path& directory : directories_with(prefix_beside(target))) {
    remove_if_stale(directory);
  }
}

void PartialDirectory::remove_stale_in(const fs::path& target) {
  for (const fs::path& directory : directories_with(prefix_in(target))) {
    rmdir(directory.c_str());  // killed before it wrote anything
    remove_if_stale(directory);
  }
  // Killed when the target had just come into being: the note is still in it.
  const fs::path note = target / kNote;
  const auto lock = FileLock::try_lock(note, FileLock::IfMissing::kGiveUp);
  const std::vector<std::string> lines = lock ? lines_of(note) : std::vector<std::string>();
  if (!lines.empty() && lines[0] == kFirstLine) unlink(note.c_str());
}

}  // namespace vggtcd
