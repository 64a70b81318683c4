// SPDX-License-Identifier: Apache-2.0
// Sim(3) in files.
#include "vggtcd/io/sim3_file.h"

#include <array>
#include <cmath>

#include "vggtcd/core/error.h"
#include "vggtcd/io/coordinate.h"
#include "vggtcd/io/failure.h"
#include "vggtcd/io/npz.h"
#include "vggtcd/io/pose_matrix.h"

namespace vggtcd {
namespace {

using RowMajor33 = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

Sim3 checked(double scale, const Eigen::Matrix3d& rotation, const Eigen::Vector3d& translation,
             const std::string& where) {
  if (!(scale > 0)) {
    throw_error(ErrorCode::kInput, "{}: expected a scale above 0, found {}", where, scale);
  }
  if (!is_coordinate(scale) || !is_coordinate(1 / scale)) {
    throw_error(ErrorCode::kInput, "{}: expected a scale from {:g} to {:g}, found {}", where,
                1 / kLargestCoordinate, kLargestCoordinate, scale);
  }
  if (!are_coordinates(translation)) {
    throw_error(ErrorCode::kInput, "{}: translation: expected {}, found {:g} {:g} {:g}", where,
                kCoordinateRange, translation.x(), translation.y(), translation.z());
  }
  return {scale, internal::nearest_rotation(rotation, where), translation};
}

std::array<double, 3> three_numbers(const Json& json, const std::string& where) {
  std::array<double, 3> values{};
  bool good = json.is_array() && json.size() == 3;
  for (size_t i = 0; good && i < 3; ++i) good = internal::json_to(json[i], values[i]);
  if (!good) throw_error(ErrorCode::kInput, "{}: expected 3 numbers", where);
  return values;
}

}  // namespace

Json sim3_to_json(const Sim3& b_from_a) {
  const Eigen::Matrix3d& r = b_from_a.rotation;
  const Eigen::Vector3d& t = b_from_a.translation;
  Json json;
  json["scale"] = b_from_a.scale;
  for (Eigen::Index row = 0; row < 3; ++row) {
    json["rotation"].push_back({r(row, 0), r(row, 1), r(row, 2)});
  }
  json["translation"] = {t.x(), t.y(), t.z()};
  return json;
}

Sim3 sim3_from_json(const Json& json, std::string_view where_view) {
  const std::string where(where_view);
  double scale = 0;
  if (!internal::json_to(json_member(json, "scale", where), scale)) {
    throw_error(ErrorCode::kInput, "{}: scale: expected a number", where);
  }
  const Json& rows = json_member(json, "rotation", where);
  if (!rows.is_array() || rows.size() != 3) {
    throw_error(ErrorCode::kInput, "{}: rotation: expected 3 rows", where);
  }
  RowMajor33 rotation;
  for (Eigen::Index row = 0; row < 3; ++row) {
    const std::array<double, 3> values =
        three_numbers(rows[static_cast<size_t>(row)], where + ": rotation");
    rotation.row(row) = Eigen::RowVector3d(values[0], values[1], values[2]);
  }
  const std::array<double, 3> t =
      three_numbers(json_member(json, "translation", where), where + ": translation");
  return checked(scale, rotation, {t[0], t[1], t[2]}, where);
}

Sim3 read_sim3(const std::filesystem::path& path) try {
  if (path.extension() != ".npz") return sim3_from_json(read_json_file(path), path.string());
  const NpzReader npz(path);
  for (const char* key : {"s", "R", "t"}) npz.header(key);
  if (npz.header("s").numel() != 1) {
    throw_error(ErrorCode::kInput, "{}: s: expected one number", npz.name());
  }
  npz.expect_shape("R", std::vector<int64_t>{3, 3});
  if (npz.header("t").numel() != 3) {
    throw_error(ErrorCode::kInput, "{}: t: expected three numbers", npz.name());
  }
  const std::vector<double> s = npz.read<double>("s"), r = npz.read<double>("R"),
                            t = npz.read<double>("t");
  return checked(s[0], Eigen::Map<const RowMajor33>(r.data()), Eigen::Vector3d(t[0], t[1], t[2]),
                 npz.name());
} catch (...) {
  rethrow_naming(path);
}

void write_sim3_npz(const std::filesystem::path& path, const Sim3& b_from_a) {
  const RowMajor33 rotation = b_from_a.rotation;
  NpzWriter npz(path);
  npz.add<double>("s", {}, {&b_from_a.scale, 1});
  npz.add<double>("R", {3, 3}, {rotation.data(), 9});
  npz.add<double>("t", {3}, {b_from_a.translation.data(), 3});
  npz.finish();
}

}  // namespace vggtcd
