// SPDX-License-Identifier: Apache-2.0
// ResultList: a line per file.
#include "vggtcd/io/result_list.h"

#include <algorithm>
#include <optional>

#include "vggtcd/core/error.h"
#include "vggtcd/core/number_text.h"
#include "vggtcd/io/input_file.h"

namespace vggtcd {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kOldText = "Written by vggt-cd, which may replace this directory.\n";
constexpr std::string_view kProgram = "vggt-cd ";
constexpr std::string_view kVersion = " 1";

// A name may hold any byte but 0 and '/'.
std::string escaped(std::string_view path) {
  std::string text;
  for (const char c : path) {
    if (c == '\\') {
      text += "\\\\";
    } else if (c == '\n') {
      text += "\\n";
    } else {
      text += c;
    }
  }
  return text;
}

std::optional<std::string> unescaped(std::string_view text) {
  std::string path;
  for (size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '\\') {
      path += text[i];
    } else if (++i < text.size() && (text[i] == '\\' || text[i] == 'n')) {
      path += text[i] == 'n' ? '\n' : '\\';
    } else {
      return {};
    }
  }
  return path;
}

// The list itself may come from elsewhere: it must not lead out of its directory.
bool stays_inside(const std::string& path) {
  if (path.empty() || path.front() == '/' || path.find('\0') != std::string::npos) return false;
  return std::ranges::all_of(fs::path(path), [](const fs::path& part) {
    return !part.empty() && part != "." && part != "..";
  });
}

std::string_view take_word(std::string_view& line) {
  const size_t end = std::min(line.find(' '), line.size());
  const std::string_view word = line.substr(0, end);
  line.remove_prefix(std::min(end + 1, line.size()));
  return word;
}

std::optional<uint64_t> hexadecimal(std::string_view word) {
  uint64_t value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value, 16);
  if (error != std::errc() || end != word.data() + word.size() || word.size() != 16) return {};
  return value;
}

}  // namespace

ResultList ResultList::parse(std::string_view text, const std::string& name) {
  if (text.empty() || text == kOldText) return ResultList("");
  const auto fail = [&](size_t line) {
    throw_error(ErrorCode::kOutput,
                "{}: line {}: expected the list of the files that vggt-cd wrote there, found "
                "something else; name another directory, or move away what you need and remove "
                "this one",
                name, line);
  };
  ResultList list("");
  for (size_t number = 1; !text.empty(); ++number) {
    const size_t end = text.find('\n');
    if (end == std::string_view::npos) fail(number);  // cut off
    std::string_view line = text.substr(0, end);
    text.remove_prefix(end + 1);
    if (number == 1) {
      if (!line.starts_with(kProgram) || !line.ends_with(kVersion)) fail(number);
      line.remove_prefix(kProgram.size());
      if (line.size() <= kVersion.size()) fail(number);
      list.kind_ = line.substr(0, line.size() - kVersion.size());
      continue;
    }
    const auto hash = hexadecimal(take_word(line));
    const auto bytes = number_in<uint64_t>(take_word(line));
    const auto path = unescaped(line);
    if (!hash || !bytes || !path || !stays_inside(*path)) fail(number);
    list.add(*path, {*bytes, *hash});
  }
  return list;
}

ResultList ResultList::read(const fs::path& file) {
  return parse(InputFile(file, "a list of results").read_all(), file.string());
}

std::string ResultList::text() const {
  std::string text = fmt::format("{}{}{}\n", kProgram, kind_, kVersion);
  for (const auto& [path, stamps] : stamps_) {
    for (const FileStamp& stamp : stamps) {
      text += fmt::format("{:016x} {} {}\n", stamp.hash, stamp.bytes, escaped(path));
    }
  }
  return text;
}

std::vector<std::string> ResultList::paths() const {
  std::vector<std::string> paths;
  for (const auto& [path, stamps] : stamps_) paths.push_back(path);
  return paths;
}

bool ResultList::owns(const fs::path& directory, const std::string& path) const {
  const auto listed = stamps_.find(path);
  if (listed == stamps_.end() || !reached_through_directories(directory, path)) return false;
  const auto bytes = size_of(directory / path);
  const auto same_size = [&](const FileStamp& stamp) { return stamp.bytes == bytes; };
  if (!bytes || std::ranges::none_of(listed->second, same_size)) return false;
  const auto found = stamp_of(directory / path);
  return found && std::ranges::find(listed->second, *found) != listed->second.end();
}

void ResultList::add(const std::string& path, const FileStamp& stamp) {
  std::vector<FileStamp>& stamps = stamps_[path];
  if (std::ranges::find(stamps, stamp) == stamps.end()) stamps.push_back(stamp);
}

void ResultList::add(const ResultList& other) {
  for (const auto& [path, stamps] : other.stamps_) {
    for (const FileStamp& stamp : stamps) add(path, stamp);
  }
}

bool reached_through_directories(const fs::path& directory, const std::string& path) {
  fs::path way = directory;
  for (const fs::path& part : fs::path(path).parent_path()) {
    way /= part;
    std::error_code error;
    const fs::file_status status = fs::symlink_status(way, error);
    if (status.type() == fs::file_type::not_found) return true;
    if (status.type() != fs::file_type::directory) return false;
  }
  return true;
}

std::vector<std::string> files_below(const fs::path& directory) {
  std::vector<std::string> paths;
  std::error_code error;
  auto entry = fs::recursive_directory_iterator(directory, error);
  for (; !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    std::error_code ignored;
    if (entry->symlink_status(ignored).type() != fs::file_type::regular) continue;
    paths.push_back(entry->path().lexically_relative(directory).string());
  }
  if (error) {
    throw_error(ErrorCode::kOutput, "{}: cannot be listed: {}", directory.string(),
                error.message());
  }
  std::ranges::sort(paths);
  return paths;
}

}  // namespace vggtcd
