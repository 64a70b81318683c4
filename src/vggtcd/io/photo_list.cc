// SPDX-License-Identifier: Apache-2.0
// photo_list: extensions and natural order.
#include "vggtcd/io/photo_list.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <string>
#include <string_view>

#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 12> kExtensions = {".jpg", ".jpeg", ".png", ".webp",
                                                          ".tif", ".tiff", ".bmp", ".ppm",
                                                          ".pgm", ".jp2",  ".jpe", ".dib"};

bool is_digit(char c) { return c >= '0' && c <= '9'; }

bool has_photo_extension(const fs::path& path) {
  std::string extension = path.extension().string();
  std::ranges::transform(extension, extension.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return std::ranges::find(kExtensions, extension) != kExtensions.end();
}

// Removes a run of digits from the front and returns it without leading zeros.
std::string_view take_number(std::string_view& text) {
  size_t size = 0;
  while (size < text.size() && is_digit(text[size])) ++size;
  std::string_view number = text.substr(0, size);
  text.remove_prefix(size);
  number.remove_prefix(std::min(number.find_first_not_of('0'), number.size()));
  return number;
}

std::vector<fs::path> photos_in(const fs::path& folder, ProgressSink& progress) {
  std::vector<fs::path> photos;
  size_t others = 0;
  std::string an_other;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    if (!entry.is_regular_file()) continue;
    if (has_photo_extension(entry.path())) {
      photos.push_back(entry.path());
    } else {
      ++others;
      an_other = entry.path().filename().string();
    }
  }
  if (error) {
    throw_error(ErrorCode::kInput, "{}: cannot be read: {}", folder.string(), error.message());
  }
  if (photos.empty()) {
    throw_error(ErrorCode::kInput, "{}: expected photos (.jpg, .png, ...), found {} other files",
                folder.string(), others);
  }
  if (others > 0) {
    progress.notice(
        fmt::format("{}: {} files are not photos, such as {}", folder.string(), others, an_other));
  }
  std::ranges::sort(photos, [](const fs::path& a, const fs::path& b) {
    return natural_less(a.filename().string(), b.filename().string());
  });
  return photos;
}

}  // namespace

bool natural_less(std::string_view a, std::string_view b) {
  const std::string_view whole_a = a, whole_b = b;
  while (!a.empty() && !b.empty()) {
    if (is_digit(a[0]) && is_digit(b[0])) {
      const std::string_view number_a = take_number(a), number_b = take_number(b);
      if (number_a.size() != number_b.size()) return number_a.size() < number_b.size();
      if (number_a != number_b) return number_a < number_b;
    } else {
      if (a[0] != b[0]) return a[0] < b[0];
      a.remove_prefix(1);
      b.remove_prefix(1);
    }
  }
  if (a.empty() != b.empty()) return a.empty();
  return whole_a < whole_b;  // differ in leading zeros only
}

std::vector<fs::path> list_photos(std::span<const fs::path> arguments, ProgressSink& progress) {
  std::vector<fs::path> photos;
  for (const fs::path& argument : arguments) {
    std::error_code error;
    if (fs::is_directory(argument, error)) {
      const std::vector<fs::path> found = photos_in(argument, progress);
      photos.insert(photos.end(), found.begin(), found.end());
    } else if (fs::exists(argument, error)) {
      photos.push_back(argument);
    } else {
      throw_error(ErrorCode::kInput, "{}: no such file or folder", argument.string());
    }
  }
  return photos;
}

}  // namespace vggtcd
