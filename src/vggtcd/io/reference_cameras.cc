// SPDX-License-Identifier: Apache-2.0
// Where cameras are known to have stood.
#include "vggtcd/io/reference_cameras.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "vggtcd/core/error.h"
#include "vggtcd/core/number_text.h"
#include "vggtcd/io/failure.h"
#include "vggtcd/io/file_system.h"
#include "vggtcd/io/input_file.h"
#include "vggtcd/io/quote.h"
#include "vggtcd/io/text_line.h"
#include "vggtcd/io/trajectory.h"

namespace vggtcd {
namespace {

namespace fs = std::filesystem;

bool is_number(std::string_view word) {
  const auto value = number_in<double>(word);
  return value && std::isfinite(*value);
}

size_t count_numbers(const TextLine& line) {
  size_t count = 0;
  for (size_t i = 0; i < line.size(); ++i) count += is_number(line.word(i)) ? 1 : 0;
  return count;
}

// The words before the last three.
std::string name_of(const TextLine& line, const std::string& text) {
  const auto begin = static_cast<size_t>(line.word(0).data() - text.data());
  const std::string_view last = line.word(line.size() - 4);
  return text.substr(begin, static_cast<size_t>(last.data() + last.size() - text.data()) - begin);
}

std::vector<ReferenceCamera> read_table(const fs::path& path) {
  InputFile file(path, "camera positions");
  std::vector<ReferenceCamera> cameras;
  std::string text;
  bool may_be_heading = true;
  for (int number = 1; std::getline(file, text); ++number) {
    std::ranges::replace_if(
        text, [](char c) { return c == ',' || c == ';'; }, ' ');
    const TextLine line(path, number, text);
    if (line.is_blank_or_comment()) continue;
    const bool is_heading = may_be_heading && count_numbers(line) == 0;
    may_be_heading = false;
    if (is_heading) continue;
    if (line.size() < 4) line.fail("name x y z", fmt::format("{} words", line.size()));
    if (line.size() == 8 && count_numbers(line) == 8) {
      cameras.push_back(
          {std::string(line.word(0)), {line.number(1), line.number(2), line.number(3)}});
    } else {
      const size_t x = line.size() - 3;
      cameras.push_back(
          {name_of(line, text), {line.number(x), line.number(x + 1), line.number(x + 2)}});
    }
  }
  return cameras;
}

std::vector<ReferenceCamera> read_model(const fs::path& path) {
  std::vector<ReferenceCamera> cameras;
  for (const NamedPose& pose : read_trajectory(path, PoseConvention::kCameraFromWorld)) {
    cameras.push_back({pose.name, camera_center(pose.camera_from_world)});
  }
  return cameras;
}

}  // namespace

std::vector<ReferenceCamera> read_reference_cameras(const fs::path& path) try {
  const bool is_model =
      is_folder(path) || path.filename() == "images.txt" || path.filename() == "images.bin";
  std::vector<ReferenceCamera> cameras = is_model ? read_model(path) : read_table(path);
  std::set<std::string> names;
  for (const ReferenceCamera& camera : cameras) {
    if (names.insert(camera.name).second) continue;
    throw_error(ErrorCode::kInput, "{}: expected every camera once, found {} twice", path.string(),
                quote(camera.name));
  }
  if (cameras.empty()) {
    throw_error(ErrorCode::kInput,
                "{}: expected camera positions (name x y z, TUM, or a COLMAP model), found none",
                path.string());
  }
  return cameras;
} catch (...) {
  rethrow_naming(path);
}

}  // namespace vggtcd
