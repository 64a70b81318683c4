// SPDX-License-Identifier: Apache-2.0
// Writing COLMAP models.
#include <Eigen/Geometry>
#include <algorithm>
#include <cstring>
#include <set>

#include "vggtcd/core/error.h"
#include "vggtcd/io/colmap.h"
#include "vggtcd/io/output_file.h"
#include "vggtcd/io/quote.h"

namespace vggtcd {
namespace {

constexpr double kPixelCentre = 0.5;
constexpr int32_t kPinholeModel = 1;

void check_names(std::span<const View> views) {
  std::set<std::string> names;
  for (const View& view : views) {
    check(!view.name.empty(), "COLMAP: image names");
    check(names.insert(single_line(view.name)).second, "COLMAP: distinct image names");
  }
}

Eigen::Quaterniond quaternion(const View& view) {
  Eigen::Quaterniond q(view.camera_from_world.rotation);
  if (q.w() < 0) q.coeffs() *= -1;  // of the two equal ones always the same
  return q;
}

// Little-endian fields without padding.
class BinaryFile {
 public:
  explicit BinaryFile(const std::filesystem::path& path) : file_(path) {}
  template <typename T>
  void put(T value) {
    std::array<std::byte, sizeof(T)> bytes;
    std::memcpy(bytes.data(), &value, sizeof(T));
    file_.write(std::span<const std::byte>(bytes));
  }
  void put_text(const std::string& text) {
    file_.write(std::string_view(text.c_str(), text.size() + 1));
  }
  void commit() { file_.commit(); }

 private:
  OutputFile file_;
};

}  // namespace

void write_colmap(const std::filesystem::path& directory, std::span<const View> views,
                  std::span<const ColoredPoint> points) {
  write_colmap_text(directory, views, points);
  const bool spaces = std::ranges::any_of(views, [](const View& view) {
    return view.name.find_first_of(" \t\v\f") != std::string::npos;
  });
  if (spaces) write_colmap_binary(directory, views, points);
}

void write_colmap_text(const std::filesystem::path& directory, std::span<const View> views,
                       std::span<const ColoredPoint> points) {
  check_names(views);
  std::string cameras = "# CAMERA_ID MODEL WIDTH HEIGHT fx fy cx cy\n";
  std::string images =
      "# IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME\n# (a line of 2D points follows: none)\n";
  for (size_t i = 0; i < views.size(); ++i) {
    const Pinhole& k = views[i].pinhole;
    cameras += fmt::format("{} PINHOLE {} {} {} {} {} {}\n", i + 1, k.width, k.height, k.fx, k.fy,
                           k.cx + kPixelCentre, k.cy + kPixelCentre);
    const Eigen::Quaterniond q = quaternion(views[i]);
    const Eigen::Vector3d& t = views[i].camera_from_world.translation;
    images += fmt::format("{} {} {} {} {} {} {} {} {} {}\n\n", i + 1, q.w(), q.x(), q.y(), q.z(),
                          t.x(), t.y(), t.z(), i + 1, single_line(views[i].name));
  }
  write_text_file(directory / "cameras.txt", cameras);
  write_text_file(directory / "images.txt", images);
  std::string lines = "# POINT3D_ID X Y Z R G B ERROR TRACK\n";
  for (size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d& x = points[i].position;
    const auto& rgb = points[i].rgb;
    lines +=
        fmt::format("{} {} {} {} {} {} {} 0\n", i + 1, x.x(), x.y(), x.z(), rgb[0], rgb[1], rgb[2]);
  }
  write_text_file(directory / "points3D.txt", lines);
}

void write_colmap_binary(const std::filesystem::path& directory, std::span<const View> views,
                         std::span<const ColoredPoint> points) {
  check_names(views);
  BinaryFile cameras(directory / "cameras.bin"), images(directory / "images.bin");
  cameras.put<uint64_t>(views.size());
  images.put<uint64_t>(views.size());
  for (size_t i = 0; i < views.size(); ++i) {
    const Pinhole& k = views[i].pinhole;
    const auto id = static_cast<uint32_t>(i + 1);
    cameras.put<uint32_t>(id);
    cameras.put<int32_t>(kPinholeModel);
    cameras.put<uint64_t>(static_cast<uint64_t>(k.width));
    cameras.put<uint64_t>(static_cast<uint64_t>(k.height));
    for (const double p : {k.fx, k.fy, k.cx + kPixelCentre, k.cy + kPixelCentre}) cameras.put(p);
    const Eigen::Quaterniond q = quaternion(views[i]);
    const Eigen::Vector3d& t = views[i].camera_from_world.translation;
    images.put<uint32_t>(id);
    for (const double p : {q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()}) images.put(p);
    images.put<uint32_t>(id);
    images.put_text(views[i].name);
    images.put<uint64_t>(0);  // 2D points
  }
  cameras.commit();
  images.commit();
  BinaryFile file(directory / "points3D.bin");
  file.put<uint64_t>(points.size());
  for (size_t i = 0; i < points.size(); ++i) {
    file.put<uint64_t>(i + 1);
    for (const double x : points[i].position) file.put(x);
    for (const uint8_t channel : points[i].rgb) file.put(channel);
    file.put<double>(0);    // error
    file.put<uint64_t>(0);  // track
  }
  file.commit();
}

}  // namespace vggtcd
