// SPDX-License-Identifier: Apache-2.0
// The model that COLMAP's mapper writes, read with every length checked.
#include "vggtcd/reconstruction/colmap_model.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>

#include "vggtcd/core/error.h"
#include "vggtcd/io/coordinate.h"
#include "vggtcd/io/failure.h"
#include "vggtcd/io/input_file.h"

namespace vggtcd {
namespace {

class ByteReader {
 public:
  explicit ByteReader(const std::filesystem::path& path)
      : name_(path.string()), bytes_(InputFile(path, "a file of a COLMAP model").read_all()) {}
  template <typename T>
  T take() {
    T value;
    if (bytes_.size() - at_ < sizeof value) cut_off();
    std::memcpy(&value, bytes_.data() + at_, sizeof value);
    at_ += sizeof value;
    return value;
  }
  double take_coordinate() {
    const double value = take<double>();
    if (!is_coordinate(value)) fail(kCoordinateRange, value);
    return value;
  }
  Eigen::Vector3d take_vector() {
    const double x = take_coordinate(), y = take_coordinate(), z = take_coordinate();
    return {x, y, z};
  }
  Eigen::Quaterniond take_rotation() {
    const double w = take_coordinate();
    const Eigen::Vector3d xyz = take_vector();
    const Eigen::Quaterniond q(w, xyz.x(), xyz.y(), xyz.z());
    if (!(std::abs(q.norm() - 1) <= 1e-2)) fail("a unit quaternion", q.norm());
    return q.normalized();
  }
  int take_side() {
    constexpr uint64_t kMaxSide = 1 << 20;
    const auto side = take<uint64_t>();
    if (side < 1 || side > kMaxSide) fail("the side of a photo in px", static_cast<double>(side));
    return static_cast<int>(side);
  }
  double take_focal() {
    const double focal = take_coordinate();
    if (!(focal > 0)) fail("a focal length above 0", focal);
    return focal;
  }
  [[noreturn]] void fail(std::string_view expected, double found) const {
    throw_error(ErrorCode::kInput, "{}: expected {}, found {:g}", name_, expected, found);
  }
  std::string take_text() {
    std::string text;
    while (const char c = take<char>()) text += c;
    return text;
  }
  void skip(uint64_t count, uint64_t size) {
    if (count > (bytes_.size() - at_) / size) cut_off();
    at_ += static_cast<size_t>(count * size);
  }
  // How many elements of at least this size follow.
  uint64_t take_count(uint64_t smallest_size) {
    const auto count = take<uint64_t>();
    if (count > (bytes_.size() - at_) / smallest_size) cut_off();
    return count;
  }
  const std::string& name() const { return name_; }

 private:
  [[noreturn]] void cut_off() const {
    throw_error(ErrorCode::kInput,
                "{}: expected a COLMAP model file, found {} bytes that end early", name_,
                bytes_.size());
  }
  std::string name_;
  std::string bytes_;
  size_t at_ = 0;
};

std::map<uint32_t, RadialCamera> read_cameras(const std::filesystem::path& path) {
  constexpr int kSimplePinhole = 0, kSimpleRadial = 2;
  ByteReader in(path);
  std::map<uint32_t, RadialCamera> cameras;
  for (uint64_t left = in.take_count(48); left > 0; --left) {
    const auto id = in.take<uint32_t>();
    const auto model = in.take<int32_t>();
    if (model != kSimplePinhole && model != kSimpleRadial) {
      throw_error(ErrorCode::kInput,
                  "{}: expected camera model {} (SIMPLE_PINHOLE) or {} (SIMPLE_RADIAL), found {}",
                  in.name(), kSimplePinhole, kSimpleRadial, model);
    }
    RadialCamera camera;
    camera.width = in.take_side();
    camera.height = in.take_side();
    camera.focal_px = in.take_focal();
    camera.cx = in.take_coordinate() - 0.5;  // COLMAP's pixel centres are at half integers
    camera.cy = in.take_coordinate() - 0.5;
    if (model == kSimpleRadial) camera.k = in.take_coordinate();
    cameras[id] = camera;
  }
  return cameras;
}

}  // namespace

SfmModel read_colmap_model(const std::filesystem::path& folder) try {
  const auto cameras = read_cameras(folder / "cameras.bin");
  ByteReader images(folder / "images.bin");
  std::vector<std::pair<SfmView, uint32_t>> views;
  for (uint64_t left = images.take_count(73); left > 0; --left) {
    const auto id = images.take<uint32_t>();
    SfmView view;
    view.camera_from_world.rotation = images.take_rotation().toRotationMatrix();
    view.camera_from_world.translation = images.take_vector();
    const auto camera = cameras.find(images.take<uint32_t>());
    if (camera == cameras.end()) {
      throw_error(ErrorCode::kInput, "{}: names a camera that is not there", images.name());
    }
    view.camera = camera->second;
    view.name = images.take_text();
    images.skip(images.take<uint64_t>(), 24);
    views.emplace_back(std::move(view), id);
  }
  std::sort(views.begin(), views.end(),
            [](const auto& a, const auto& b) { return a.first.name < b.first.name; });
  SfmModel model;
  std::map<uint32_t, int> number_of;
  for (auto& [view, id] : views) {
    number_of[id] = static_cast<int>(model.views.size());
    model.views.push_back(std::move(view));
  }

  ByteReader points(folder / "points3D.bin");
  for (uint64_t left = points.take_count(51); left > 0; --left) {
    points.skip(1, 8);  // its number
    SfmPoint point;
    point.x_in_world = points.take_vector();
    points.skip(3, 1);  // its colour
    point.error_px = points.take<double>();
    for (uint64_t seen = points.take_count(8); seen > 0; --seen) {
      const auto view = number_of.find(points.take<uint32_t>());
      points.skip(1, 4);
      if (view != number_of.end()) point.views.push_back(view->second);
    }
    std::sort(point.views.begin(), point.views.end());
    point.views.erase(std::unique(point.views.begin(), point.views.end()), point.views.end());
    model.points.push_back(std::move(point));
  }
  return model;
} catch (...) {
  rethrow_naming(folder);
}

}  // namespace vggtcd
