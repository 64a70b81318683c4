// SPDX-License-Identifier: Apache-2.0
// The photos of one epoch from what a user names: listing, natural order, duplicates.
#include "vggtcd/io/photo_source.h"

#include <fnmatch.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <map>
#include <opencv2/imgproc.hpp>
#include <set>

#include "vggtcd/core/error.h"
#include "vggtcd/io/video.h"

namespace vggtcd {
namespace {

namespace fs = std::filesystem;

const std::set<std::string> kPictures = {".jpg", ".jpeg", ".png", ".webp", ".tif",  ".tiff",
                                         ".bmp", ".ppm",  ".pgm", ".jp2",  ".heic", ".heif"};
const std::set<std::string> kVideos = {".mp4", ".mov", ".avi", ".mkv", ".webm", ".m4v", ".mpg"};

std::string ending_of(const fs::path& path) {
  std::string ending = path.extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return ending;
}

bool is_pattern(const std::string& source) {
  return source.find_first_of("*?[") != std::string::npos && !fs::exists(source);
}

std::vector<fs::path> files_matching(const fs::path& folder, const std::string& pattern) {
  std::error_code failed;
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder, failed)) {
    const std::string name = entry.path().filename().string();
    if (name.front() == '.' || !entry.is_regular_file()) continue;
    const bool wanted = pattern.empty() ? kPictures.count(ending_of(entry.path())) > 0
                                        : fnmatch(pattern.c_str(), name.c_str(), 0) == 0;
    if (wanted) files.push_back(entry.path());
  }
  if (failed) {
    throw_error(ErrorCode::kInput, "{}: cannot be listed ({})", folder.string(), failed.message());
  }
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    return natural_less(a.filename().string(), b.filename().string());
  });
  return files;
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

std::vector<fs::path> list_files(const std::string& source) {
  const fs::path path(source);
  if (fs::is_directory(path)) return files_matching(path, "");
  if (is_pattern(source)) {
    const fs::path folder = path.parent_path().empty() ? fs::path(".") : path.parent_path();
    return files_matching(folder, path.filename().string());
  }
  if (!fs::exists(path)) {
    throw_error(ErrorCode::kInput, "{}: no such file or folder", source);
  }
  return {path};
}

}  // namespace

bool natural_less(const std::string& a, const std::string& b) {
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  size_t i = 0, j = 0;
  while (i < a.size() && j < b.size()) {
    if (!digit(a[i]) || !digit(b[j])) {
      if (a[i] != b[j]) return static_cast<unsigned char>(a[i]) < static_cast<unsigned char>(b[j]);
      ++i, ++j;
      continue;
    }
    while (i < a.size() && a[i] == '0') ++i;
    while (j < b.size() && b[j] == '0') ++j;
    const size_t from_i = i, from_j = j;
    while (i < a.size() && digit(a[i])) ++i;
    while (j < b.size() && digit(b[j])) ++j;
    if (i - from_i != j - from_j) return i - from_i < j - from_j;
    const int order = a.compare(from_i, i - from_i, b, from_j, j - from_j);
    if (order != 0) return order < 0;
  }
  if (i < a.size() || j < b.size()) return j < b.size();
  return a < b;  // equal but for leading zeros
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

uint64_t content_hash(const PhotoRef& photo) {
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
  std::ifstream file(photo.path, std::ios::binary);
  if (!file) throw_error(ErrorCode::kInput, "{}: cannot be opened", photo.path.string());
  std::vector<char> buffer(1 << 20);
  while (file.read(buffer.data(), static_cast<std::streamsize>(buffer.size())), file.gcount() > 0) {
    mix(buffer.data(), static_cast<size_t>(file.gcount()));
  }
  return hash;
}

bool names_photos(const std::string& source) { return ending_of(source) != ".npz"; }

Image load_photo(const PhotoRef& photo, const ImageReadOptions& options) {
  if (photo.decoded) return *photo.decoded;
  const std::string ending = ending_of(photo.path);
  if (ending == ".heic" || ending == ".heif") {
    throw_error(ErrorCode::kInput,
                "{}: HEIC photos are not read; convert them to JPEG first (heif-convert from "
                "Debian's libheif-examples)",
                photo.path.string());
  }
  return read_image(photo.path, options);
}

std::vector<PhotoRef> find_photos(const std::string& source, const PhotoSourceOptions& options,
                                  ProgressSink& progress) {
  if (kVideos.count(ending_of(source)) > 0 && fs::is_regular_file(source)) {
    constexpr int kVideoFrames = 40;
    const int frames = options.max_frames > 0 ? options.max_frames : kVideoFrames;
    std::vector<PhotoRef> photos = read_video(source, frames, progress);
    leave_out_duplicates(photos, progress);
    return photos;
  }
  std::vector<PhotoRef> photos;
  for (const fs::path& file : list_files(source)) {
    photos.push_back({file, file.filename().string(), nullptr});
  }
  if (photos.empty()) {
    throw_error(ErrorCode::kInput, "{}: expected photos (jpg, png, webp, tiff ...), found none",
                source);
  }
  leave_out_duplicates(photos, progress);
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
