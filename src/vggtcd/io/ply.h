// SPDX-License-Identifier: Apache-2.0
// Point clouds as PLY (binary little-endian) with colour and scalar fields, named so that
// CloudCompare and MeshLab show them.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "vggtcd/io/output_file.h"

namespace vggtcd {

// Writes point by point, so that no copy of the cloud is needed.
//   PlyWriter ply(path, count, {"change_distance", "changed"}, {"frame: T2"});
//   for each point: ply.add(x, rgb, values);
//   ply.commit();
// In the file a field is called scalar_NAME, which CloudCompare shows as NAME. MeshLab knows one
// scalar per vertex, "quality": a copy of the first field. Throws Error{kOutput}.
class PlyWriter {
 public:
  // Field names are letters, digits and underscores; comments are single lines of the header. With
  // an origin other than zero positions are relative to it: the file has the sums, as doubles.
  PlyWriter(std::filesystem::path path, size_t num_points, std::vector<std::string> fields,
            std::span<const std::string> comments = {},
            const Eigen::Vector3d& origin = Eigen::Vector3d::Zero());
  // rgb: three bytes; values: one per field.
  void add(const Eigen::Vector3f& position, const uint8_t* rgb, std::span<const float> values);
  // Expects that num_points were added.
  void commit();

 private:
  void flush();

  OutputFile file_;
  Eigen::Vector3d origin_;
  size_t num_points_;
  size_t num_fields_;
  size_t added_ = 0;
  std::vector<std::byte> buffer_;
};

struct PlyCloud {
  struct Field {
    std::string name;  // without "scalar_"
    std::vector<float> values;
  };
  std::vector<Eigen::Vector3f> positions;
  std::vector<uint8_t> rgb;   // 3 per point, or empty if the file has no colours
  std::vector<Field> fields;  // every other property of the vertices

  // nullptr if there is none of that name.
  const std::vector<float>* field(std::string_view name) const;
};

// The vertices of a binary little-endian PLY; other elements must come after them. Opening reads
// the header and compares the file's size with it. Throws Error{kInput}.
class PlyReader {
 public:
  explicit PlyReader(const std::filesystem::path& path);
  ~PlyReader();
  PlyReader(const PlyReader&) = delete;
  PlyReader& operator=(const PlyReader&) = delete;

  size_t size() const;                             // points
  const std::vector<std::string>& fields() const;  // of PlyCloud

  // The points in file order, in blocks that are as good as none in memory: positions (less the
  // origin, before they are rounded to floats), colours if the file has them, and the fields of
  // these names, which must be there.
  void read(std::span<const std::string> fields,
            const std::function<void(const PlyCloud& block)>& sink,
            const Eigen::Vector3d& origin = Eigen::Vector3d::Zero()) const;

 private:
  struct Layout;
  std::filesystem::path path_;
  std::unique_ptr<const Layout> layout_;
};

// All of it.
PlyCloud read_ply(const std::filesystem::path& path);

}  // namespace vggtcd
