// SPDX-License-Identifier: Apache-2.0
// Reading COLMAP models: untrusted text and bytes.
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <iterator>

#include "vggtcd/core/error.h"
#include "vggtcd/io/colmap.h"
#include "vggtcd/io/coordinate.h"
#include "vggtcd/io/failure.h"
#include "vggtcd/io/file_system.h"
#include "vggtcd/io/input_file.h"
#include "vggtcd/io/photo_source.h"
#include "vggtcd/io/text_file.h"
#include "vggtcd/io/text_line.h"

namespace vggtcd {
namespace {

struct CameraModel {
  const char* name;
  size_t num_params;
};
// In the order of COLMAP's model ids (src/colmap/sensor/models.h of COLMAP 4).
constexpr CameraModel kModels[] = {{"SIMPLE_PINHOLE", 3},
                                   {"PINHOLE", 4},
                                   {"SIMPLE_RADIAL", 4},
                                   {"RADIAL", 5},
                                   {"OPENCV", 8},
                                   {"OPENCV_FISHEYE", 8},
                                   {"FULL_OPENCV", 12},
                                   {"FOV", 5},
                                   {"SIMPLE_RADIAL_FISHEYE", 4},
                                   {"RADIAL_FISHEYE", 5},
                                   {"THIN_PRISM_FISHEYE", 12},
                                   {"RAD_TAN_THIN_PRISM_FISHEYE", 16},
                                   {"SIMPLE_DIVISION", 4},
                                   {"DIVISION", 5},
                                   {"SIMPLE_FISHEYE", 3},
                                   {"FISHEYE", 4},
                                   {"EUCM", 6}};

// A binary file in memory, read field by field.
class BinaryReader {
 public:
  explicit BinaryReader(const std::filesystem::path& path)
      : name_(path.string()), bytes_(InputFile(path, "a file of a COLMAP model").read_all()) {}
  template <typename T>
  T get() {
    need(sizeof(T), 1);
    T value;
    std::memcpy(&value, bytes_.data() + position_, sizeof(T));
    position_ += sizeof(T);
    return value;
  }
  double get_finite() {
    const double value = get<double>();
    if (!std::isfinite(value)) fail("finite numbers", "NaN or infinity");
    return value;
  }
  double get_coordinate() {
    const double value = get<double>();
    if (!is_coordinate(value)) fail(kCoordinateRange, fmt::format("{:g}", value));
    return value;
  }
  // A number of things that take at least this many bytes each: a lie is found before memory is
  // reserved for it.
  uint64_t get_count(size_t bytes_each) {
    const uint64_t count = get<uint64_t>();
    need(bytes_each, count);
    return count;
  }
  void skip(size_t bytes_each, uint64_t count) {
    need(bytes_each, count);
    position_ += static_cast<size_t>(count) * bytes_each;
  }
  std::string get_text() {
    const size_t end = bytes_.find('\0', position_);
    if (end == std::string::npos) fail("the end of a name", "the end of the file");
    std::string text = bytes_.substr(position_, end - position_);
    position_ = end + 1;
    return text;
  }
  [[noreturn]] void fail(std::string_view expected, std::string_view found) const {
    throw_error(ErrorCode::kInput, "{}: expected {}, found {}", name_, expected, found);
  }

 private:
  void need(size_t bytes_each, uint64_t count) const {
    if (count > (bytes_.size() - position_) / bytes_each) {
      fail("more data", "the end of the file; truncated or no COLMAP model");
    }
  }
  std::string name_;
  std::string bytes_;
  size_t position_ = 0;
};

Eigen::Quaterniond checked(const Eigen::Quaterniond& q, const BinaryReader& file) {
  if (!(std::abs(q.norm() - 1) <= 1e-2)) {
    file.fail("a unit quaternion", fmt::format("norm {:.4g}", q.norm()));
  }
  return q.normalized();
}

void read_binary_cameras(const std::filesystem::path& path, ColmapModel& model) {
  BinaryReader file(path);
  for (uint64_t left = file.get_count(24); left > 0; --left) {
    const auto id = file.get<uint32_t>();
    const auto model_id = file.get<int32_t>();
    if (model_id < 0 || model_id >= static_cast<int32_t>(std::size(kModels))) {
      // How many parameters follow is not known, so nothing behind it can be found.
      file.fail(fmt::format("camera models from 0 to {}", std::size(kModels) - 1),
                fmt::format("{}; convert the model to text (colmap model_converter)", model_id));
    }
    ColmapCamera camera;
    camera.model = kModels[model_id].name;
    camera.width = static_cast<int64_t>(file.get<uint64_t>());
    camera.height = static_cast<int64_t>(file.get<uint64_t>());
    for (size_t i = 0; i < kModels[model_id].num_params; ++i) {
      camera.params.push_back(file.get_finite());
    }
    model.cameras[id] = camera;
  }
}

void read_binary_images(const std::filesystem::path& path, ColmapModel& model) {
  BinaryReader file(path);
  for (uint64_t left = file.get_count(73); left > 0; --left) {
    const auto id = file.get<uint32_t>();
    ColmapImage image;
    double q[4];
    for (double& value : q) value = file.get_finite();
    image.camera_from_world.rotation =
        checked(Eigen::Quaterniond(q[0], q[1], q[2], q[3]), file).toRotationMatrix();
    for (double& value : image.camera_from_world.translation) value = file.get_coordinate();
    image.camera_id = file.get<uint32_t>();
    image.name = file.get_text();
    const auto points2d = file.get<uint64_t>();
    file.skip(24, points2d);  // x, y, point id
    model.images[id] = image;
  }
}

void read_binary_points(const std::filesystem::path& path, ColmapModel& model) {
  BinaryReader file(path);
  const uint64_t count = file.get_count(51);
  model.points.reserve(count);
  for (uint64_t left = count; left > 0; --left) {
    ColmapPoint point;
    file.get<uint64_t>();  // id
    for (double& value : point.position) value = file.get_coordinate();
    for (uint8_t& channel : point.rgb) channel = file.get<uint8_t>();
    point.error_px = file.get<double>();
    for (uint64_t track = file.get_count(8); track > 0; --track) {
      point.image_ids.push_back(file.get<uint32_t>());
      file.get<uint32_t>();  // which of the image's 2D points
    }
    model.points.push_back(std::move(point));
  }
}

// Calls use(line) for each line of data; with `pairs`, each is followed by a line that is skipped.
template <typename Use>
void for_each_line(const std::filesystem::path& path, bool pairs, const Use& use) {
  bool skip = false;
  for_each_text_line(path, "a file of a COLMAP model", [&](int number, std::string_view text) {
    if (skip) {
      skip = false;
      return;
    }
    const TextLine line(path, number, text);
    if (line.is_blank_or_comment()) return;
    use(line);
    skip = pairs;
  });
}

uint32_t get_id(const TextLine& line, size_t i) {
  const int64_t id = line.integer(i);
  if (id < 0 || id > 0xffffffffll) line.fail("an id from 0 to 2^32 - 1", line.word(i));
  return static_cast<uint32_t>(id);
}

void expect_model_name(const TextLine& line, const std::string& name) {
  const bool good = std::ranges::all_of(
      name, [](char c) { return (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_'; });
  if (!good) line.fail("the name of a COLMAP camera model (PINHOLE, ...)", name);
}

void read_text_cameras(const std::filesystem::path& path, ColmapModel& model) {
  for_each_line(path, false, [&](const TextLine& line) {
    ColmapCamera camera{std::string(line.word(1)), line.integer(2), line.integer(3), {}};
    const auto* known = std::find_if(std::begin(kModels), std::end(kModels),
                                     [&](const CameraModel& m) { return camera.model == m.name; });
    // A model that is newer than this list may have any number of parameters.
    if (known == std::end(kModels)) expect_model_name(line, camera.model);
    if (known != std::end(kModels)) {
      line.expect_count(4 + known->num_params,
                        fmt::format("{} parameters of {}", known->num_params, camera.model));
    }
    for (size_t i = 4; i < line.size(); ++i) camera.params.push_back(line.number(i));
    model.cameras[get_id(line, 0)] = camera;
  });
}

void read_text_images(const std::filesystem::path& path, ColmapModel& model) {
  for_each_line(path, true, [&](const TextLine& line) {
    ColmapImage image;
    image.camera_from_world.rotation = line.unit_quaternion({2, 3, 4, 1}).toRotationMatrix();
    image.camera_from_world.translation = {line.coordinate(5), line.coordinate(6),
                                           line.coordinate(7)};
    image.camera_id = get_id(line, 8);
    image.name = std::string(line.rest(9));
    model.images[get_id(line, 0)] = image;
  });
}

void read_text_points(const std::filesystem::path& path, ColmapModel& model) {
  for_each_line(path, false, [&](const TextLine& line) {
    ColmapPoint point;
    point.position = {line.coordinate(1), line.coordinate(2), line.coordinate(3)};
    for (size_t i = 0; i < 3; ++i) {
      const int64_t level = line.integer(4 + i);
      if (level < 0 || level > 255) line.fail("a colour from 0 to 255", line.word(4 + i));
      point.rgb[i] = static_cast<uint8_t>(level);
    }
    point.error_px = line.number(7);
    for (size_t i = 8; i < line.size(); i += 2) point.image_ids.push_back(get_id(line, i));
    model.points.push_back(std::move(point));
  });
}

std::vector<const ColmapImage*> sorted_images(const ColmapModel& model) {
  std::vector<const ColmapImage*> images;
  for (const auto& [id, image] : model.images) images.push_back(&image);
  std::stable_sort(images.begin(), images.end(),
                   [](const auto* a, const auto* b) { return natural_less(a->name, b->name); });
  return images;
}

// Whether the model is binary.
bool find_form(const std::filesystem::path& directory) {
  if (exists_at(directory / "images.bin")) return true;
  if (exists_at(directory / "images.txt")) return false;
  throw_error(ErrorCode::kInput,
              "{}: expected a COLMAP model (images.bin or images.txt), found neither",
              directory.string());
}

void read_images(const std::filesystem::path& directory, bool binary, ColmapModel& model) {
  binary ? read_binary_images(directory / "images.bin", model)
         : read_text_images(directory / "images.txt", model);
}

}  // namespace

ColmapModel read_colmap(const std::filesystem::path& directory) try {
  ColmapModel model;
  const bool binary = find_form(directory);
  binary ? read_binary_cameras(directory / "cameras.bin", model)
         : read_text_cameras(directory / "cameras.txt", model);
  read_images(directory, binary, model);
  const std::filesystem::path points = directory / (binary ? "points3D.bin" : "points3D.txt");
  if (exists_at(points)) {
    binary ? read_binary_points(points, model) : read_text_points(points, model);
  }
  for (const auto& [id, image] : model.images) {
    if (!model.cameras.contains(image.camera_id)) {
      throw_error(ErrorCode::kInput, "{}: expected a camera {} for image {}, found none",
                  directory.string(), image.camera_id, id);
    }
  }
  return model;
} catch (...) {
  rethrow_naming(directory);
}

std::vector<View> colmap_views(const ColmapModel& model) {
  constexpr double kPixelCentre = 0.5;
  std::vector<View> views;
  for (const ColmapImage* image : sorted_images(model)) {
    const ColmapCamera& camera = model.cameras.at(image->camera_id);
    const bool simple = camera.model == "SIMPLE_PINHOLE";
    if (!simple && camera.model != "PINHOLE") {
      throw_error(ErrorCode::kInput,
                  "COLMAP camera {}: expected PINHOLE, found {}; run colmap image_undistorter",
                  image->camera_id, camera.model);
    }
    constexpr int64_t kMaxSide = 1 << 20;
    if (camera.width < 1 || camera.height < 1 || camera.width > kMaxSide ||
        camera.height > kMaxSide) {
      throw_error(ErrorCode::kInput, "COLMAP camera {}: expected a size in pixels, found {} x {}",
                  image->camera_id, camera.width, camera.height);
    }
    const std::vector<double>& p = camera.params;
    View view{image->camera_from_world, {}, image->name};
    view.pinhole = {p[0],
                    simple ? p[0] : p[1],
                    p[simple ? 1 : 2] - kPixelCentre,
                    p[simple ? 2 : 3] - kPixelCentre,
                    static_cast<int>(camera.width),
                    static_cast<int>(camera.height)};
    views.push_back(view);
  }
  return views;
}

Trajectory colmap_trajectory(const ColmapModel& model) {
  Trajectory trajectory;
  for (const ColmapImage* image : sorted_images(model)) {
    trajectory.push_back({image->name, image->camera_from_world});
  }
  return trajectory;
}

Trajectory read_colmap_trajectory(const std::filesystem::path& directory) {
  ColmapModel model;
  read_images(directory, find_form(directory), model);
  return colmap_trajectory(model);
}

}  // namespace vggtcd
