// SPDX-License-Identifier: Apache-2.0
// The photos of one epoch from what a user names: listing, natural order, duplicates.
#include "vggtcd/io/photo_source.h"

#include <fnmatch.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <opencv2/imgproc.hpp>
#include <set>

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/io/failure.h"
#include "vggtcd/io/file_system.h"
#include "vggtcd/io/input_file.h"
#include "vggtcd/io/mapped_file.h"
#include "vggtcd/io/photo_companions.h"
#include "vggtcd/io/picture_header.h"
#include "vggtcd/io/video.h"

namespace vggtcd {
namespace {

namespace fs = std::filesystem;

const std::set<std::string> kPictures = {".jpg", ".jpeg", ".jpe",  ".png",  ".webp",
                                         ".tif", ".tiff", ".bmp",  ".dib",  ".ppm",
                                         ".pgm", ".jp2",  ".heic", ".heif", ".avif"};
const std::set<std::string> kVideos = {".mp4",  ".mov", ".avi", ".mkv",  ".webm", ".m4v", ".mpg",
                                       ".mpeg", ".3gp", ".mts", ".m2ts", ".wmv",  ".ogv"};

bool is_digit(char c) { return c >= '0' && c <= '9'; }

std::string ending_of(const fs::path& path) {
  std::string ending = path.extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return ending;
}

bool is_pattern(const std::string& source) {
  return source.find_first_of("*?[") != std::string::npos && !exists_at(source);
}

struct Listing {
  std::vector<fs::path> files;
  size_t others = 0;  // of a folder: visible files that are not pictures
  std::string an_other;
  std::string a_folder;              // below a folder: one that is visible, without its pictures
  std::vector<fs::path> unreadable;  // of a folder: named like pictures, but no ordinary files
};

// An empty pattern: the pictures.
Listing files_matching(const fs::path& folder, const std::string& pattern) {
  Listing found;
  for (const fs::path& entry : list_folder(folder)) {
    const std::string name = entry.filename().string();
    if (name.front() == '.') continue;
    const bool wanted = pattern.empty() ? kPictures.count(ending_of(entry)) > 0
                                        : fnmatch(pattern.c_str(), name.c_str(), 0) == 0;
    if (is_folder(entry)) {
      found.a_folder = name;
    } else if (!is_file(entry)) {
      if (wanted) found.unreadable.push_back(entry);
    } else if (wanted) {
      found.files.push_back(entry);
    } else if (pattern.empty()) {
      ++found.others;
      found.an_other = name;
    }
  }
  std::sort(found.files.begin(), found.files.end(), [](const fs::path& a, const fs::path& b) {
    return natural_less(a.filename().string(), b.filename().string());
  });
  return found;
}

std::vector<PhotoRef> video_frames(const std::string& path, int frames,
                                   ProgressSink& progress) try {
  return read_video(path, frames, progress);
} catch (...) {
  rethrow_naming(path);
}

void leave_out_duplicates(std::vector<PhotoRef>& photos, ProgressSink& progress) {
  std::map<uint64_t, std::string> seen;
  std::erase_if(photos, [&](const PhotoRef& photo) {
    const auto [first, is_new] = seen.emplace(content_hash(photo), photo.name);
    if (!is_new) {
      progress.notice(
          fmt::format("{} is the same photo as {} and left out", photo.name, first->second));
    }
    return !is_new;
  });
}

Listing list_files(const std::string& source) {
  const fs::path path(source);
  if (is_folder(path)) return files_matching(path, "");
  if (is_pattern(source)) {
    const fs::path folder = path.parent_path().empty() ? fs::path(".") : path.parent_path();
    return files_matching(folder, path.filename().string());
  }
  if (!is_file(path)) {
    throw_error(ErrorCode::kInput, "{}: expected a photo, a folder of photos or a video, found {}",
                source, what_stands_at(path));
  }
  return {{path}, 0, "", "", {}};
}

// What there is instead of photos.
std::string in_words(const Listing& found, const std::string& source) {
  std::string words = found.others == 0 ? "none"
                      : found.others == 1
                          ? "only " + found.an_other
                          : fmt::format("{} other files, such as {}", found.others, found.an_other);
  if (kVideos.count(ending_of(found.an_other)) > 0) {
    words +=
        fmt::format("; name the video itself: {}", (fs::path(source) / found.an_other).string());
  } else if (!found.a_folder.empty()) {
    words += fmt::format("; photos of folders below are not taken: name the folder itself, {}",
                         (fs::path(source) / found.a_folder).string());
  }
  return words;
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

}  // namespace

bool natural_less(std::string_view a, std::string_view b) {
  const std::string_view whole_a = a, whole_b = b;
  while (!a.empty() && !b.empty()) {
    if (is_digit(a[0]) && is_digit(b[0])) {
      const std::string_view number_a = take_number(a), number_b = take_number(b);
      if (number_a.size() != number_b.size()) return number_a.size() < number_b.size();
      if (number_a != number_b) return number_a < number_b;
    } else {
      if (a[0] != b[0]) return static_cast<unsigned char>(a[0]) < static_cast<unsigned char>(b[0]);
      a.remove_prefix(1);
      b.remove_prefix(1);
    }
  }
  if (a.empty() != b.empty()) return a.empty();
  return whole_a < whole_b;  // differ in leading zeros only
}

std::vector<int> evenly_spaced(int total, int count) {
  std::vector<int> chosen;
  if (count >= total) count = total;
  for (int i = 0; i < count; ++i) {
    chosen.push_back(
        count == 1 ? 0 : static_cast<int>(static_cast<int64_t>(i) * (total - 1) / (count - 1)));
  }
  return chosen;
}

double sharpness(const Image& image) {
  const cv::Mat rgb(image.height, image.width, CV_8UC3, const_cast<uint8_t*>(image.rgb.data()));
  cv::Mat gray, laplacian;
  cv::cvtColor(rgb, gray, cv::COLOR_RGB2GRAY);
  cv::Laplacian(gray, laplacian, CV_32F);
  cv::Scalar mean, deviation;
  cv::meanStdDev(laplacian, mean, deviation);
  return deviation[0] * deviation[0];
}

uint64_t content_hash(const PhotoRef& photo) try {
  uint64_t hash = 0xcbf29ce484222325u;
  const auto mix = [&hash](const char* bytes, size_t count) {
    for (size_t i = 0; i < count; ++i) {
      hash = (hash ^ static_cast<unsigned char>(bytes[i])) * 0x100000001b3u;
    }
  };
  if (photo.decoded) {
    mix(reinterpret_cast<const char*>(photo.decoded->rgb.data()), photo.decoded->rgb.size());
    return hash;
  }
  const InputDescriptor file(photo.path, "a photo");
  std::vector<char> buffer(1 << 20);
  while (const size_t count = file.read(buffer)) mix(buffer.data(), count);
  return hash;
} catch (...) {
  rethrow_naming(photo.path);
}

bool names_photos(const std::string& source) { return ending_of(source) != ".npz"; }

Image load_photo(const PhotoRef& photo, const ImageReadOptions& options, PhotoFacts* facts) try {
  if (photo.decoded) return *photo.decoded;
  Image image = read_image(photo.path, options, facts);
  require_photo_size(image, photo.path.string());
  return image;
} catch (...) {
  rethrow_naming(photo.path);
}

void require_photo_size(const Image& image, const std::string& name) {
  constexpr int kLeastSide = 16;  // px: below, there is no place for a single key point
  if (std::min(image.width, image.height) >= kLeastSide) return;
  throw_error(ErrorCode::kInput,
              "{}: expected pictures of at least {} px a side, found {} x {}; leave it out", name,
              kLeastSide, image.width, image.height);
}

void PhotoRemarks::add(const std::string& photo, const PhotoFacts& facts) {
  for (const std::string& remark : facts.remarks) {
    auto at = std::ranges::find(photos_of_, remark, &decltype(photos_of_)::value_type::first);
    if (at == photos_of_.end()) at = photos_of_.insert(at, {remark, {}});
    at->second.push_back(photo);
  }
}

void PhotoRemarks::report(ProgressSink& progress) const {
  for (const auto& [remark, photos] : photos_of_) {
    const size_t others = photos.size() - 1;
    progress.notice(fmt::format("{}{}: {}", photos.front(),
                                others == 0 ? "" : fmt::format(" and {} more like it", others),
                                remark));
  }
}

int64_t largest_decode_bytes(const std::vector<const PhotoRef*>& photos) {
  int64_t most = 0;
  for (const PhotoRef* photo : photos) {
    if (photo->decoded) continue;
    most = std::max(most, decode_bytes(read_file_bytes(photo->path)));
  }
  return most;
}

int photos_at_once(int64_t bytes) {
  constexpr int64_t kBudgetBytes = 2'000'000'000;
  const int64_t fitting = std::max<int64_t>(1, kBudgetBytes / std::max<int64_t>(1, bytes));
  return static_cast<int>(std::min<int64_t>(num_threads(), fitting));
}

std::vector<PhotoRef> find_photos(const std::string& source, const PhotoSourceOptions& options,
                                  ProgressSink& progress) {
  if (kVideos.count(ending_of(source)) > 0 && is_file(source)) {
    constexpr int kVideoFrames = 40;
    const int frames = options.max_frames > 0 ? options.max_frames : kVideoFrames;
    std::vector<PhotoRef> photos = video_frames(source, frames, progress);
    leave_out_duplicates(photos, progress);
    return photos;
  }
  const Listing found = list_files(source);
  std::vector<PhotoRef> photos;
  for (const fs::path& file : found.files) {
    photos.push_back({file, file.filename().string(), nullptr});
  }
  for (const fs::path& path : found.unreadable) {
    progress.notice(fmt::format("{} is left out: it is {}", path.string(), what_stands_at(path)));
  }
  if (photos.empty()) {
    throw_error(ErrorCode::kInput, "{}: expected photos (jpg, png, heic, webp, tiff ...), found {}",
                source, in_words(found, source));
  }
  if (found.others > 0) {
    progress.notice(found.others == 1 ? fmt::format("{}: {} is not a photo", source, found.an_other)
                                      : fmt::format("{}: {} files are not photos, such as {}",
                                                    source, found.others, found.an_other));
  }
  if (photos.size() > 1) {
    leave_out_masks(photos, progress);
    leave_out_duplicates(photos, progress);
    leave_out_second_formats(photos, options.read, progress);
  }
  if (options.max_frames > 0 && static_cast<int>(photos.size()) > options.max_frames) {
    std::vector<PhotoRef> chosen;
    for (const int i : evenly_spaced(static_cast<int>(photos.size()), options.max_frames)) {
      chosen.push_back(photos[static_cast<size_t>(i)]);
    }
    photos = std::move(chosen);
  }
  return photos;
}

}  // namespace vggtcd
