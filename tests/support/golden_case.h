// SPDX-License-Identifier: Apache-2.0
// GoldenCase: one .npz of tests/golden/vggt: whole arrays and samples of arrays of the reference
// network, and the comparison of our tensors with them.
#pragma once

#include <filesystem>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "vggtcd/core/tensor_view.h"
#include "vggtcd/io/npz.h"

namespace vggtcd::testing {

// b the reference: rel_l2 = |a - b| / |b|, rel_max = max|a - b| / max|b|.
struct Deviation {
  double rel_l2 = 0, rel_max = 0;
  std::string worst;  // "at element 17: expected 1.5, found 1.25"
};

Deviation deviation(std::span<const float> found, std::span<const float> expected);

class GoldenCase {
 public:
  explicit GoldenCase(const std::filesystem::path& path);

  // Whether the reference has a tensor of this name, whole or sampled.
  bool has(std::string_view name) const;
  std::vector<float> whole(std::string_view name) const;
  std::vector<int64_t> shape(std::string_view name) const;

  // Compares a whole f32 tensor of ours with what the reference has of it. A reference [S, 8, 64]
  // of a larger [S, N, C] is its first 8 tokens and 64 channels.
  Deviation compare(const TensorView& ours);
  // Names that compare() was not called with.
  std::vector<std::string> unread() const;

 private:
  NpzReader npz_;
  std::set<std::string, std::less<>> names_, read_;
};

}  // namespace vggtcd::testing
