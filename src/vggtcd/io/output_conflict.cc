// SPDX-License-Identifier: Apache-2.0
// Outputs that would stand on inputs: where each of them really is.
#include "vggtcd/io/output_conflict.h"

#include <fnmatch.h>

#include "vggtcd/core/error.h"
#include "vggtcd/io/output_path.h"
#include "vggtcd/io/result_list.h"

namespace vggtcd {
namespace {

namespace fs = std::filesystem;

enum class Relation { kHolds, kIs, kLiesIn };

[[noreturn]] void refuse(const fs::path& out, Relation relation, const std::string& input,
                         const char* what) {
  const char* words = relation == Relation::kHolds ? "it holds the input"
                      : relation == Relation::kIs  ? "it is the input"
                                                   : "it lies in the input";
  throw_error(ErrorCode::kOutput, "{}: cannot be written: {} {}; name another {}, outside of it",
              out.string(), words, input, what);
}

bool is_there(const fs::path& path) {
  std::error_code error;
  return fs::exists(path, error);
}

bool is_folder(const fs::path& path) {
  std::error_code error;
  return fs::is_directory(path, error);
}

fs::path folder_of(const fs::path& pattern) {
  return pattern.has_parent_path() ? pattern.parent_path() : fs::path(".");
}

// A file of the folder that is a link into `out`; empty if there is none.
fs::path linked_into(const fs::path& folder, const fs::path& out) {
  std::error_code error;
  auto entry = fs::directory_iterator(folder, error);
  for (; !error && entry != fs::directory_iterator(); entry.increment(error)) {
    std::error_code ignored;
    const bool is_link = entry->symlink_status(ignored).type() == fs::file_type::symlink;
    if (is_link && is_there(entry->path()) && lies_in(entry->path(), out)) return entry->path();
  }
  return {};
}

}  // namespace

void require_directory_apart(const fs::path& out, const std::vector<std::string>& inputs) {
  constexpr const char* kWhat = "directory";
  if (out.empty()) return;
  const fs::path target = resolve_output(out);
  for (const std::string& input : inputs) {
    if (input.empty()) continue;
    const bool there = is_there(input);
    const fs::path at = there ? fs::path(input) : folder_of(input);  // else a pattern
    if (!is_there(at)) continue;
    if (there && same_file(at, target)) refuse(out, Relation::kIs, input, kWhat);
    if (is_there(target) && lies_in(at, target)) refuse(out, Relation::kHolds, input, kWhat);
    if (!is_folder(at)) continue;
    if (there && lies_in(target, at)) refuse(out, Relation::kLiesIn, input, kWhat);
    if (!is_there(target)) continue;
    if (const fs::path link = linked_into(at, target); !link.empty()) {
      refuse(out, Relation::kHolds, link.string(), kWhat);
    }
  }
}

void require_file_apart(const fs::path& out, const std::vector<std::string>& inputs) {
  constexpr const char* kWhat = "file";
  if (out.empty()) return;
  const fs::path target = resolve_output(out);
  for (const std::string& input : inputs) {
    if (input.empty()) continue;
    if (!is_there(input)) {
      const fs::path pattern(input);
      const bool matches = same_file(target.parent_path(), folder_of(pattern)) &&
                           fnmatch(pattern.filename().c_str(), target.filename().c_str(), 0) == 0;
      if (matches && is_there(target)) refuse(out, Relation::kIs, input, kWhat);
    } else if (is_folder(input)) {
      if (lies_in(target, input)) refuse(out, Relation::kLiesIn, input, kWhat);
      if (is_there(target) && !linked_into(input, target).empty()) {
        refuse(out, Relation::kIs, linked_into(input, target).string(), kWhat);
      }
    } else if (same_file(target, input)) {
      refuse(out, Relation::kIs, input, kWhat);
    }
  }
}

void require_no_result(const fs::path& out, const fs::path& results) {
  const fs::path list = results / ResultList::kFile;
  if (out.empty() || !is_there(list) || !lies_in(out, results)) return;
  const fs::path name = resolve_output(out).lexically_relative(resolve_output(results));
  if (!ResultList::read(list).lists(name.string())) return;
  throw_error(ErrorCode::kOutput,
              "{}: cannot be written: it is one of the results in {}; name another file",
              out.string(), results.string());
}

}  // namespace vggtcd
