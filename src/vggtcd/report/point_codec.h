// SPDX-License-Identifier: Apache-2.0
// A cloud as the page carries it: which points, in which order, in how many bits (docs/formats.md).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "vggtcd/report/levels.h"
#include "vggtcd/report/report_input.h"

namespace vggtcd {

// The box that positions are quantised in: all points, but for strays farther out than its own
// size.
struct QuantizationBox {
  Eigen::Vector3f min = Eigen::Vector3f::Zero();
  Eigen::Vector3f size = Eigen::Vector3f::Ones();  // > 0

  bool contains(const Eigen::Vector3f& x) const {
    return (x.array() >= min.array()).all() && (x.array() <= (min + size).array()).all();
  }
};
QuantizationBox quantization_box(const ReportCloud& cloud);

// The points of a cloud that could be shown, split by what decides who goes first.
struct Candidates {
  QuantizationBox box;
  std::vector<uint32_t> changed;    // by label if there are labels, else distance > threshold
  std::vector<uint32_t> unchanged;  // the others inside the box
  int64_t all_changed = 0;          // including strays
  int64_t far_away = 0;             // strays and points that are not finite
};
Candidates find_candidates(const ReportCloud& cloud, const LevelScale& scale);

// `count` of the indices, evenly spread over them without a period; all if count is not smaller.
std::vector<uint32_t> spread_sample(std::span<const uint32_t> indices, int64_t count);

// How many points of each kind each cloud may show: changed ones first, then unchanged ones, in
// proportion.
struct Shares {
  int64_t changed_before = 0, changed_after = 0;
  int64_t unchanged_before = 0, unchanged_after = 0;
};
Shares share_points(const Candidates& before, const Candidates& after, int64_t max_points);

// The chosen points along a Morton curve, each attribute a zlib stream.
struct EncodedCloud {
  int64_t points = 0;
  std::string
      position;  // 6 planes: low and high byte of the zigzagged steps of x, y and z, 16 bits each
  std::string color;  // 3 planes: steps of r, g and b modulo 64, 6 bits each
  std::string level;  // LevelScale::level
  std::string label;  // empty if the cloud has none
};
EncodedCloud encode_cloud(const ReportCloud& cloud, std::vector<uint32_t> chosen,
                          const QuantizationBox& box, const LevelScale& scale);

// zlib stream (RFC 1950).
std::string deflate_bytes(std::string_view bytes);

}  // namespace vggtcd
