// SPDX-License-Identifier: Apache-2.0
// Kept files: a list of the same form as that of results.
#include "vggtcd/io/kept_files.h"

#include <algorithm>

#include "vggtcd/core/error.h"
#include "vggtcd/io/output_file.h"
#include "vggtcd/io/result_list.h"

namespace vggtcd {
namespace {

namespace fs = std::filesystem;

bool is_there(const fs::path& path) {
  std::error_code error;
  return fs::symlink_status(path, error).type() != fs::file_type::not_found;
}

bool is_folder(const fs::path& path) {
  std::error_code error;
  return fs::symlink_status(path, error).type() == fs::file_type::directory;
}

// Nothing is kept where the list is damaged.
ResultList list_of(const fs::path& folder) {
  const fs::path file = folder / kKeptList;
  if (!is_there(file)) return ResultList("stages");
  try {
    return ResultList::read(file);
  } catch (const Error&) {
    return ResultList("stages");
  }
}

bool is_of(const std::string& path, const std::string& name) {
  return path == name || path.starts_with(name + "/");
}

}  // namespace

void keep(const fs::path& folder, const std::string& name) {
  ResultList list = list_of(folder);
  for (const std::string& path : list.paths()) {
    if (is_of(path, name)) list.remove(path);
  }
  std::vector<std::string> paths = {name};
  if (is_folder(folder / name)) {
    paths = files_below(folder / name);
    for (std::string& path : paths) path = name + "/" + path;
  }
  for (const std::string& path : paths) {
    const auto stamp = stamp_of(folder / path);
    if (!stamp) {
      throw_error(ErrorCode::kOutput, "{}: cannot be read again", (folder / path).string());
    }
    list.add(path, *stamp);
  }
  write_text_file(folder / kKeptList, list.text());
}

bool is_kept(const fs::path& folder, const std::string& name) {
  const ResultList list = list_of(folder);
  bool any = false;
  for (const std::string& path : list.paths()) {
    if (!is_of(path, name)) continue;
    if (!list.owns(folder, path)) return false;
    any = true;
  }
  return any;
}

std::vector<std::string> damaged_files(const fs::path& folder) {
  std::vector<std::string> damaged;
  const ResultList list = list_of(folder);
  if (list.empty() && is_there(folder / kKeptList)) return {kKeptList};
  for (const std::string& path : list.paths()) {
    if (is_there(folder / path) && !list.owns(folder, path)) damaged.push_back(path);
  }
  return damaged;
}

}  // namespace vggtcd
