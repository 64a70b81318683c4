// SPDX-License-Identifier: Apache-2.0
// std::filesystem with error codes, and what they mean in words.
#include "vggtcd/io/file_system.h"

#include <algorithm>
#include <new>
#include <system_error>

#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

namespace fs = std::filesystem;

fs::file_type type_at(const fs::path& path) {
  std::error_code error;
  return fs::status(path, error).type();
}

void throw_if(const std::error_code& error, ErrorCode code, const fs::path& path,
              std::string_view what) {
  if (!error) return;
  if (error == std::errc::not_enough_memory) throw std::bad_alloc();
  throw_error(code, "{}: cannot be {}: {}", path.string(), what, error.message());
}

}  // namespace

bool exists_at(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  return !error && fs::exists(status);
}

bool is_file(const fs::path& path) { return type_at(path) == fs::file_type::regular; }

bool is_folder(const fs::path& path) { return type_at(path) == fs::file_type::directory; }

bool is_link(const fs::path& path) {
  std::error_code error;
  return fs::symlink_status(path, error).type() == fs::file_type::symlink;
}

std::string what_stands_at(const fs::path& path) {
  std::error_code error;
  switch (fs::status(path, error).type()) {
    case fs::file_type::regular:
      return std::string(kAFile);
    case fs::file_type::directory:
      return "a directory";
    case fs::file_type::not_found:
      return is_link(path) ? "a link that leads nowhere" : "no such file";
    case fs::file_type::none:
      return error == std::errc::too_many_symbolic_link_levels
                 ? "a link that leads to itself"
                 : fmt::format("nothing that can be reached ({})", error.message());
    default:
      return "a pipe or a device, no ordinary file";
  }
}

std::vector<fs::path> list_folder(const fs::path& folder) {
  std::error_code error;
  std::vector<fs::path> entries;
  fs::directory_iterator entry(folder, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    entries.push_back(entry->path());
  }
  throw_if(error, ErrorCode::kInput, folder, "listed");
  std::sort(entries.begin(), entries.end());
  return entries;
}

std::vector<fs::path> list_tree(const fs::path& folder) {
  std::vector<fs::path> all;
  for (const fs::path& entry : list_folder(folder)) {
    all.push_back(entry);
    std::error_code error;
    if (fs::symlink_status(entry, error).type() != fs::file_type::directory) continue;
    for (fs::path& below : list_tree(entry)) all.push_back(std::move(below));
  }
  return all;
}

void make_folder(const fs::path& path) {
  std::error_code error;
  fs::create_directories(path, error);
  throw_if(error, ErrorCode::kOutput, path, "created");
}

void remove_tree(const fs::path& path) {
  std::error_code error;
  fs::remove_all(path, error);
  throw_if(error, ErrorCode::kOutput, path, "removed");
}

void move_to(const fs::path& from, const fs::path& to) {
  std::error_code error;
  fs::rename(from, to, error);
  throw_if(error, ErrorCode::kOutput, to, "written");
}

void copy_unless_there(const fs::path& from, const fs::path& to) {
  std::error_code error;
  fs::copy_file(from, to, fs::copy_options::skip_existing, error);
  throw_if(error, ErrorCode::kOutput, to, "written");
}

uint64_t size_of_file(const fs::path& path) {
  std::error_code error;
  const uint64_t size = fs::file_size(path, error);
  throw_if(error, ErrorCode::kInput, path, "read");
  return size;
}

fs::path absolute_path(const fs::path& path) {
  std::error_code error;
  fs::path absolute = fs::absolute(path, error);
  throw_if(error, ErrorCode::kInput, path, "found");
  return absolute;
}

fs::path without_links(const fs::path& path) {
  std::error_code error;
  fs::path canonical = fs::canonical(path, error);
  throw_if(error, ErrorCode::kInput, path, "found");
  return canonical;
}

}  // namespace vggtcd
