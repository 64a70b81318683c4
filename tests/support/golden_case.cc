// SPDX-License-Identifier: Apache-2.0
// GoldenCase: reference tensors, whole or sampled (tests/golden/vggt/make.py).
#include "tests/support/golden_case.h"

#include <algorithm>
#include <cmath>

#include "vggtcd/core/error.h"

namespace vggtcd::testing {
namespace {

std::string with(std::string_view prefix, std::string_view name) {
  return std::string(prefix) + std::string(name);
}

// The first shape[1] rows and shape[2] columns of every matrix of [S, N, C].
std::vector<float> crop(std::span<const float> values, std::span<const int64_t> from,
                        std::span<const int64_t> to) {
  check(from.size() == 3 && to.size() == 3 && from[0] == to[0],
        "golden: only [S, N, C] is cropped");
  std::vector<float> out;
  for (int64_t s = 0; s < to[0]; ++s) {
    for (int64_t n = 0; n < to[1]; ++n) {
      const float* row = values.data() + (s * from[1] + n) * from[2];
      out.insert(out.end(), row, row + to[2]);
    }
  }
  return out;
}

}  // namespace

Deviation deviation(std::span<const float> found, std::span<const float> expected) {
  check(found.size() == expected.size() && !found.empty(), "deviation: sizes agree");
  double difference = 0, norm = 0, largest_difference = -1, largest = 0;
  size_t worst = 0;
  for (size_t i = 0; i < found.size(); ++i) {
    const double b = expected[i];
    double d = std::abs(static_cast<double>(found[i]) - b);
    if (!std::isfinite(d)) d = HUGE_VAL;
    difference += d * d;
    norm += b * b;
    largest = std::max(largest, std::abs(b));
    if (d > largest_difference) {
      largest_difference = d;
      worst = i;
    }
  }
  return {std::sqrt(difference / norm), largest_difference / largest,
          fmt::format("at element {}: expected {:.9g}, found {:.9g}", worst, expected[worst],
                      found[worst])};
}

GoldenCase::GoldenCase(const std::filesystem::path& path) : npz_(path) {
  for (const std::string& key : npz_.keys()) {
    if (key.starts_with("SAMPLE__")) {
      names_.insert(key.substr(8));
    } else if (!key.starts_with("SHAPE__") && !key.starts_with("STEP__")) {
      names_.insert(key);
    }
  }
}

bool GoldenCase::has(std::string_view name) const { return names_.contains(name); }

std::vector<float> GoldenCase::whole(std::string_view name) const { return npz_.read<float>(name); }

std::vector<int64_t> GoldenCase::shape(std::string_view name) const {
  if (npz_.has(name)) return npz_.header(name).shape;
  return npz_.read<int64_t>(with("SHAPE__", name));
}

Deviation GoldenCase::compare(const TensorView& ours) {
  check(ours.dtype == DType::kF32, "golden: f32");
  read_.insert(ours.name);
  const std::vector<int64_t> expected_shape = shape(ours.name);
  std::span values(reinterpret_cast<const float*>(ours.data.data()),
                   static_cast<size_t>(ours.numel()));
  std::vector<float> cropped;
  if (ours.shape != expected_shape) {
    cropped = crop(values, ours.shape, expected_shape);
    values = cropped;
  }
  if (npz_.has(ours.name)) return deviation(values, whole(ours.name));
  const auto step = static_cast<size_t>(npz_.read<int64_t>(with("STEP__", ours.name))[0]);
  std::vector<float> sampled;
  for (size_t i = 0; i < values.size(); i += step) sampled.push_back(values[i]);
  return deviation(sampled, npz_.read<float>(with("SAMPLE__", ours.name)));
}

std::vector<std::string> GoldenCase::unread() const {
  std::vector<std::string> names;
  for (const std::string& name : names_) {
    if (!read_.contains(name) && name != "images") names.push_back(name);
  }
  return names;
}

}  // namespace vggtcd::testing
