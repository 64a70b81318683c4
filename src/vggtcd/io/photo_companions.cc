// SPDX-License-Identifier: Apache-2.0
// Pictures that are no photos of their own: told by their names, and where these do not tell, by
// what they show.
#include "vggtcd/io/photo_companions.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <set>

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"

namespace vggtcd {
namespace {

std::string lower_case(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

std::string stem_of(const PhotoRef& photo) {
  return std::filesystem::path(photo.name).stem().string();
}

// "IMG_1.png, IMG_2.png and 10 more"
std::string in_words(const std::vector<std::string>& names) {
  constexpr size_t kNamed = 3;
  std::string words;
  for (size_t i = 0; i < std::min(names.size(), kNamed); ++i) {
    words += (i == 0 ? "" : ", ") + names[i];
  }
  if (names.size() > kNamed) words += fmt::format(" and {} more", names.size() - kNamed);
  return words;
}

// What two pictures are compared by: brightness in a grid, whatever their sizes.
struct Look {
  cv::Mat gray;
  double width = 0, height = 0;
};

std::optional<Look> look_at(const PhotoRef& photo, const ImageReadOptions& read) {
  constexpr int kGrid = 64;
  try {
    const Image image = load_photo(photo, read);
    const cv::Mat rgb(image.height, image.width, CV_8UC3, const_cast<uint8_t*>(image.rgb.data()));
    cv::Mat small, gray;
    cv::resize(rgb, small, {kGrid, kGrid}, 0, 0, cv::INTER_AREA);
    cv::cvtColor(small, gray, cv::COLOR_RGB2GRAY);
    gray.convertTo(gray, CV_32F);
    return Look{gray, static_cast<double>(image.width), static_cast<double>(image.height)};
  } catch (const Error& error) {
    if (error.code() == ErrorCode::kInterrupted) throw;
    return std::nullopt;  // whoever needs the photo says what is wrong with it
  }
}

bool show_the_same(const Look& a, const Look& b) {
  // Compression and another decoder change the mean of a cell by less; a step of the photographer
  // changes it by more.
  constexpr double kMeanLevels = 2, kShape = 0.02;
  const double shape = a.width * b.height / (a.height * b.width);
  if (std::abs(shape - 1) > kShape) return false;
  return cv::norm(a.gray, b.gray, cv::NORM_L1) <= kMeanLevels * static_cast<double>(a.gray.total());
}

// Of photos of one name: which of them repeat another.
std::vector<size_t> repeated(const std::vector<size_t>& group, const std::vector<PhotoRef>& photos,
                             const ImageReadOptions& read) {
  std::vector<size_t> left_out;
  std::vector<std::pair<size_t, Look>> kept;
  for (const size_t i : group) {
    const std::optional<Look> look = look_at(photos[i], read);
    if (!look) continue;
    const auto same = std::find_if(kept.begin(), kept.end(), [&](const auto& other) {
      return show_the_same(other.second, *look);
    });
    if (same == kept.end()) {
      kept.emplace_back(i, *look);
    } else if (look->width * look->height > same->second.width * same->second.height) {
      left_out.push_back(same->first);
      *same = {i, *look};
    } else {
      left_out.push_back(i);
    }
  }
  return left_out;
}

}  // namespace

void leave_out_masks(std::vector<PhotoRef>& photos, ProgressSink& progress) {
  std::set<std::string> names, stems;
  for (const PhotoRef& photo : photos) {
    names.insert(lower_case(photo.name));
    stems.insert(lower_case(stem_of(photo)));
  }
  const auto is_mask = [&](const PhotoRef& photo) {
    const std::string stem = lower_case(stem_of(photo));
    if (names.contains(stem)) return true;
    if (stem == "mask") return photos.size() > 1;
    for (const std::string_view ending : {"_mask", "-mask", ".mask"}) {
      if (!stem.ends_with(ending)) continue;
      if (stems.contains(stem.substr(0, stem.size() - ending.size()))) return true;
    }
    return false;
  };
  std::vector<std::string> masks;
  for (const PhotoRef& photo : photos) {
    if (is_mask(photo)) masks.push_back(photo.name);
  }
  if (masks.empty()) return;
  std::erase_if(photos, [&](const PhotoRef& photo) {
    return std::ranges::find(masks, photo.name) != masks.end();
  });
  progress.notice(
      fmt::format("{} {} by name, not photos, and left out: {}; masks are not used", masks.size(),
                  masks.size() == 1 ? "file is a mask" : "files are masks", in_words(masks)));
}

void leave_out_second_formats(std::vector<PhotoRef>& photos, const ImageReadOptions& read,
                              ProgressSink& progress) {
  std::map<std::string, std::vector<size_t>> by_stem;
  for (size_t i = 0; i < photos.size(); ++i) by_stem[stem_of(photos[i])].push_back(i);
  std::vector<std::vector<size_t>> groups;
  for (auto& [stem, group] : by_stem) {
    if (group.size() > 1) groups.push_back(std::move(group));
  }
  std::vector<std::vector<size_t>> left_out(groups.size());
  parallel_for(static_cast<int64_t>(groups.size()), 1, [&](int64_t begin, int64_t end) {
    for (auto g = static_cast<size_t>(begin); g < static_cast<size_t>(end); ++g) {
      left_out[g] = repeated(groups[g], photos, read);
    }
  });
  std::set<size_t> all;
  for (const std::vector<size_t>& some : left_out) all.insert(some.begin(), some.end());
  if (all.empty()) return;
  std::vector<std::string> names;
  for (const size_t i : all) names.push_back(photos[i].name);
  size_t at = 0;
  std::erase_if(photos, [&](const PhotoRef&) { return all.contains(at++); });
  progress.notice(fmt::format(
      "{} {} what another one of the same name shows, in another format, and left out: {}",
      names.size(), names.size() == 1 ? "photo repeats" : "photos repeat", in_words(names)));
}

}  // namespace vggtcd
