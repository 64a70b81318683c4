// SPDX-License-Identifier: Apache-2.0
// Where an output goes: readlink, getrandom, and device and inode numbers.
#include "vggtcd/io/output_path.h"

#include <sys/random.h>
#include <sys/stat.h>

#include <array>
#include <cerrno>

#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxLinks = 40;  // as the kernel follows

std::string random_suffix() {
  constexpr std::string_view kLetters = "abcdefghijklmnopqrstuvwxyz0123456789";
  std::array<unsigned char, 6> bytes{};
  check(getrandom(bytes.data(), bytes.size(), 0) == std::ssize(bytes), "getrandom");
  std::string suffix;
  for (const unsigned char byte : bytes) suffix += kLetters[byte % kLetters.size()];
  return suffix;
}

}  // namespace

fs::path resolve_output(const fs::path& path) {
  std::error_code error;
  fs::path resolved = fs::absolute(path, error);
  for (int links = 0; !error; ++links) {
    resolved = fs::weakly_canonical(resolved, error);
    if (error) break;
    if (!resolved.has_filename()) resolved = resolved.parent_path();  // a final slash
    std::error_code ignored;
    if (!fs::is_symlink(resolved, ignored)) return resolved;
    if (links == kMaxLinks) error = std::make_error_code(std::errc::too_many_symbolic_link_levels);
    const fs::path next = fs::read_symlink(resolved, ignored);
    resolved = resolved.parent_path() / next;
  }
  throw_error(ErrorCode::kOutput, "{}: cannot be written: {}", path.string(), error.message());
}

std::string partial_prefix(const std::string& name) {
  constexpr size_t kMaxBytes = 220, kKeptBytes = 180;
  constexpr std::string_view kPartial = ".partial-";
  if (name.size() <= kMaxBytes) return name + std::string(kPartial);
  return fmt::format("{}.{:x}{}", name.substr(0, kKeptBytes), std::hash<std::string>{}(name),
                     kPartial);
}

fs::path make_unique(const fs::path& prefix, const std::function<bool(const fs::path&)>& make) {
  constexpr int kTries = 100;
  for (int i = 0; i < kTries; ++i) {
    fs::path path = prefix;
    path += random_suffix();
    if (make(path)) return path;
    if (errno != EEXIST) break;
  }
  return {};
}

bool same_file(const fs::path& a, const fs::path& b) {
  struct stat of_a = {}, of_b = {};
  return stat(a.c_str(), &of_a) == 0 && stat(b.c_str(), &of_b) == 0 && of_a.st_dev == of_b.st_dev &&
         of_a.st_ino == of_b.st_ino;
}

bool lies_in(const fs::path& path, const fs::path& directory) {
  for (fs::path at = resolve_output(path);; at = at.parent_path()) {
    if (same_file(at, directory)) return true;
    if (at == at.parent_path()) return false;
  }
}

}  // namespace vggtcd
