// SPDX-License-Identifier: Apache-2.0
// A cloud as the page carries it: which points, in which order, in how many bits (docs/formats.md).
#include "vggtcd/report/point_codec.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/core/splitmix64.h"
#include "vggtcd/geometry/order_statistics.h"

namespace vggtcd {
namespace {

constexpr float kSteps = 65535.0f;
constexpr int64_t kGrain = 1 << 15;

// Spreads the low 16 bits so that two zeros follow each.
uint64_t spread_bits(uint64_t x) {
  x = (x | (x << 32)) & 0x1f00000000ffffULL;
  x = (x | (x << 16)) & 0x1f0000ff0000ffULL;
  x = (x | (x << 8)) & 0x100f00f00f00f00fULL;
  x = (x | (x << 4)) & 0x10c30c30c30c30c3ULL;
  x = (x | (x << 2)) & 0x1249249249249249ULL;
  return x;
}

using Quantized = std::array<uint16_t, 3>;

Quantized quantize(const Eigen::Vector3f& x, const QuantizationBox& box) {
  Quantized q{};
  for (int axis = 0; axis < 3; ++axis) {
    const float share = (x[axis] - box.min[axis]) / box.size[axis];
    q[static_cast<size_t>(axis)] =
        static_cast<uint16_t>(std::lround(std::clamp(share, 0.0f, 1.0f) * kSteps));
  }
  return q;
}

bool is_changed_label(uint8_t label) { return label == 1 || label == 2 || label == 4; }

// The points of these numbers, which ascend.
ReportPoints chosen_points(const ReportCloud& cloud, std::span<const uint32_t> chosen) {
  ReportPoints points;
  size_t first = 0, next = 0;
  cloud.for_each_block([&](const ReportPoints& block) {
    const size_t end = first + block.positions.size();
    for (; next < chosen.size() && chosen[next] < end; ++next) {
      const size_t i = chosen[next] - first;
      points.positions.push_back(block.positions[i]);
      points.color.insert(points.color.end(), &block.color[3 * i], &block.color[3 * i] + 3);
      points.change_distance.push_back(block.change_distance[i]);
      if (cloud.has_labels) points.label.push_back(block.label[i]);
    }
    first = end;
  });
  return points;
}

std::string plane_bytes(size_t size, const std::function<uint8_t(size_t)>& value) {
  std::string bytes(size, '\0');
  for (size_t i = 0; i < size; ++i) bytes[i] = static_cast<char>(value(i));
  return bytes;
}

}  // namespace

ReportCloud cloud_of(ReportPoints points) {
  ReportCloud cloud;
  cloud.size = points.positions.size();
  cloud.has_labels = !points.label.empty();
  check(points.color.size() == 3 * cloud.size && points.change_distance.size() == cloud.size,
        "cloud_of: a color and a distance for every point");
  check(points.label.empty() || points.label.size() == cloud.size,
        "cloud_of: a label for every point or none");
  const auto shared = std::make_shared<const ReportPoints>(std::move(points));
  cloud.for_each_block = [shared](const auto& sink) { sink(*shared); };
  return cloud;
}

QuantizationBox quantization_box(const ReportCloud& cloud) {
  constexpr size_t kSample = 100000;
  std::vector<Eigen::Vector3f> sample;
  const size_t stride = std::max<size_t>(1, cloud.size / kSample);
  Eigen::Vector3f min = Eigen::Vector3f::Constant(INFINITY), max = -min;
  size_t number = 0;
  cloud.for_each_block([&](const ReportPoints& block) {
    for (const Eigen::Vector3f& x : block.positions) {
      const bool sampled = number++ % stride == 0;
      if (!x.allFinite()) continue;
      if (sampled) sample.push_back(x);
      min = min.cwiseMin(x);
      max = max.cwiseMax(x);
    }
  });
  QuantizationBox box;
  if (sample.empty()) return box;
  const std::array<double, 2> percents = {0.1, 99.9};
  const Eigen::Matrix3Xd spread = percentiles(sample, percents);
  const Eigen::Vector3f low = spread.col(0).cast<float>(), high = spread.col(1).cast<float>();
  const float longest = (high - low).maxCoeff();
  const float size = longest > 0 ? longest : 1.0f;  // of one place any box will do
  const Eigen::Vector3f margin = Eigen::Vector3f::Constant(size);
  min = min.cwiseMax(low - margin).cwiseMin(low);
  max = max.cwiseMin(high + margin).cwiseMax(high);
  box.min = min;
  box.size = (max - min).cwiseMax(1e-6f * size);
  return box;
}

Candidates find_candidates(const ReportCloud& cloud, const LevelScale& scale) {
  Candidates found;
  found.box = quantization_box(cloud);
  const float threshold = scale.edge(scale.threshold_level());
  uint32_t number = 0;
  cloud.for_each_block([&](const ReportPoints& block) {
    for (size_t i = 0; i < block.positions.size(); ++i, ++number) {
      const bool changed = cloud.has_labels ? is_changed_label(block.label[i])
                                            : block.change_distance[i] > threshold;
      found.all_changed += changed;
      if (!block.positions[i].allFinite() || !found.box.contains(block.positions[i])) {
        ++found.far_away;
      } else {
        (changed ? found.changed : found.unchanged).push_back(number);
      }
    }
  });
  return found;
}

std::vector<uint32_t> spread_sample(std::span<const uint32_t> indices, int64_t count) {
  const auto size = static_cast<int64_t>(indices.size());
  if (count >= size) return {indices.begin(), indices.end()};
  std::vector<uint32_t> sample;
  sample.reserve(static_cast<size_t>(count));
  for (int64_t k = 0; k < count; ++k) {  // one at random out of each of `count` equal stretches
    const int64_t begin = k * size / count, end = (k + 1) * size / count;
    const auto offset = static_cast<int64_t>(splitmix64(static_cast<uint64_t>(k)) %
                                             static_cast<uint64_t>(end - begin));
    sample.push_back(indices[static_cast<size_t>(begin + offset)]);
  }
  return sample;
}

Shares share_points(const Candidates& before, const Candidates& after, int64_t max_points) {
  const auto size = [](const std::vector<uint32_t>& v) { return static_cast<int64_t>(v.size()); };
  // Splits `room` over two counts in proportion, never more than there are.
  const auto split = [](int64_t room, int64_t a, int64_t b) {
    if (a + b <= room) return std::pair(a, b);
    const auto share = static_cast<int64_t>(std::llround(
        static_cast<double>(room) * static_cast<double>(a) / static_cast<double>(a + b)));
    return std::pair(share, room - share);
  };
  Shares shares;
  std::tie(shares.changed_before, shares.changed_after) =
      split(max_points, size(before.changed), size(after.changed));
  const int64_t room = max_points - shares.changed_before - shares.changed_after;
  std::tie(shares.unchanged_before, shares.unchanged_after) =
      split(room, size(before.unchanged), size(after.unchanged));
  return shares;
}

EncodedCloud encode_cloud(const ReportCloud& all, std::vector<uint32_t> chosen,
                          const QuantizationBox& box, const LevelScale& scale) {
  const size_t n = chosen.size();
  std::ranges::sort(chosen);
  const ReportPoints cloud = chosen_points(all, chosen);
  std::vector<std::pair<uint64_t, uint32_t>> order(n);
  parallel_for(static_cast<int64_t>(n), kGrain, [&](int64_t begin, int64_t end) {
    for (auto i = static_cast<size_t>(begin); i < static_cast<size_t>(end); ++i) {
      const Quantized q = quantize(cloud.positions[i], box);
      order[i] = {spread_bits(q[0]) | spread_bits(q[1]) << 1 | spread_bits(q[2]) << 2,
                  static_cast<uint32_t>(i)};
    }
  });
  std::sort(order.begin(), order.end());

  std::string position(6 * n, '\0'), color(3 * n, '\0');
  for (size_t axis = 0; axis < 3; ++axis) {
    int last_position = 0, last_color = 0;
    for (size_t i = 0; i < n; ++i) {
      const uint32_t point = order[i].second;
      const int q = quantize(cloud.positions[point], box)[axis];
      const auto step = static_cast<int16_t>(q - last_position);
      const auto zigzag = static_cast<uint16_t>((step * 2) ^ (step >> 15));
      position[2 * axis * n + i] = static_cast<char>(zigzag & 255);
      position[(2 * axis + 1) * n + i] = static_cast<char>(zigzag >> 8);
      last_position = q;
      const int c = cloud.color[3 * size_t{point} + axis] >> 2;
      color[axis * n + i] = static_cast<char>((c - last_color) & 63);
      last_color = c;
    }
  }
  EncodedCloud encoded;
  encoded.points = static_cast<int64_t>(n);
  parallel_for(4, 1, [&](int64_t begin, int64_t) {
    switch (begin) {
      case 0:
        encoded.position = deflate_bytes(position);
        break;
      case 1:
        encoded.color = deflate_bytes(color);
        break;
      case 2:
        encoded.level = deflate_bytes(plane_bytes(
            n, [&](size_t i) { return scale.level(cloud.change_distance[order[i].second]); }));
        break;
      default:
        if (!cloud.label.empty()) {
          encoded.label =
              deflate_bytes(plane_bytes(n, [&](size_t i) { return cloud.label[order[i].second]; }));
        }
    }
  });
  return encoded;
}

std::string deflate_bytes(std::string_view bytes) {
  uLongf size = compressBound(static_cast<uLong>(bytes.size()));
  std::string packed(size, '\0');
  const int status =
      compress2(reinterpret_cast<Bytef*>(packed.data()), &size,
                reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uLong>(bytes.size()), 6);
  check(status == Z_OK, "deflate_bytes: zlib");
  packed.resize(size);
  return packed;
}

}  // namespace vggtcd
