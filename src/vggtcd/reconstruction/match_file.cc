// SPDX-License-Identifier: Apache-2.0
// The matches stage as a file: flat arrays, counts first.
#include "vggtcd/reconstruction/match_file.h"

#include <algorithm>
#include <array>

#include "vggtcd/core/error.h"
#include "vggtcd/io/failure.h"
#include "vggtcd/io/npz.h"

namespace vggtcd {
namespace {

// The i-th count, checked against what is left of the rows it counts.
size_t take(const std::vector<int64_t>& counts, size_t i, size_t left, const std::string& name) {
  if (counts[i] < 0 || static_cast<size_t>(counts[i]) > left) {
    throw_error(ErrorCode::kInput, "{}: counts contradict the arrays; delete the file", name);
  }
  return static_cast<size_t>(counts[i]);
}

}  // namespace

void write_matches(const std::filesystem::path& path, const SparseMatches& matches) {
  std::vector<int64_t> points_per_photo, pairs, matches_per_pair, rows;
  std::vector<float> points;
  for (const Features& features : matches.features) {
    points_per_photo.push_back(static_cast<int64_t>(features.points.size()));
    for (const KeyPoint& p : features.points) {
      points.insert(points.end(), {p.u_px, p.v_px, p.scale_px, p.angle_rad});
    }
  }
  for (const PhotoPair& pair : matches.pairs) {
    pairs.insert(pairs.end(), {pair.first, pair.second, pair.homography_inliers});
    matches_per_pair.push_back(static_cast<int64_t>(pair.matches.size()));
    for (const Match& match : pair.matches) rows.insert(rows.end(), {match.first, match.second});
  }
  const auto size = [](const auto& values) { return static_cast<int64_t>(values.size()); };
  NpzWriter writer(path);
  writer.add<int64_t>("points_per_photo", {size(points_per_photo)}, points_per_photo);
  writer.add<float>("points", {size(points) / 4, 4}, points);
  writer.add<int64_t>("pairs", {size(pairs) / 3, 3}, pairs);
  writer.add<int64_t>("matches_per_pair", {size(matches_per_pair)}, matches_per_pair);
  writer.add<int64_t>("matches", {size(rows) / 2, 2}, rows);
  writer.finish();
}

SparseMatches read_matches(const std::filesystem::path& path) try {
  const NpzReader reader(path);
  reader.expect_shape("points", std::array<int64_t, 2>{-1, 4});
  reader.expect_shape("pairs", std::array<int64_t, 2>{-1, 3});
  reader.expect_shape("matches", std::array<int64_t, 2>{-1, 2});
  const auto points_per_photo = reader.read<int64_t>("points_per_photo");
  const auto points = reader.read<float>("points");
  const auto pairs = reader.read<int64_t>("pairs");
  const auto matches_per_pair = reader.read<int64_t>("matches_per_pair");
  const auto rows = reader.read<int64_t>("matches");
  reader.expect_shape("matches_per_pair",
                      std::array<int64_t, 1>{static_cast<int64_t>(pairs.size() / 3)});
  SparseMatches result;
  const float* p = points.data();
  const float* const end = p + points.size();
  for (size_t photo = 0; photo < points_per_photo.size(); ++photo) {
    Features features;
    const size_t count =
        take(points_per_photo, photo, static_cast<size_t>(end - p) / 4, reader.name());
    for (size_t k = 0; k < count; ++k, p += 4) features.points.push_back({p[0], p[1], p[2], p[3]});
    result.features.push_back(std::move(features));
  }
  size_t row = 0;
  for (size_t i = 0; i < matches_per_pair.size(); ++i) {
    const int64_t first = pairs[3 * i], second = pairs[3 * i + 1];
    PhotoPair pair{
        static_cast<int>(first), static_cast<int>(second), {}, static_cast<int>(pairs[3 * i + 2])};
    if (first < 0 || first >= second || second >= std::ssize(result.features)) {
      throw_error(ErrorCode::kInput, "{}: names photos that are not there; delete the file",
                  reader.name());
    }
    const size_t count = take(matches_per_pair, i, rows.size() / 2 - row, reader.name());
    for (size_t k = 0; k < count; ++k, ++row) {
      pair.matches.push_back(
          {static_cast<int32_t>(rows[2 * row]), static_cast<int32_t>(rows[2 * row + 1])});
    }
    result.pairs.push_back(std::move(pair));
  }
  return result;
} catch (...) {
  rethrow_naming(path);
}

}  // namespace vggtcd
