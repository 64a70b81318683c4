// SPDX-License-Identifier: Apache-2.0
// DepthCorrection: a factor for every depth of an epoch, on a coarse grid of each photo, because
// what it takes off is smooth and a second copy of all depths would be large.
#pragma once

#include <cstddef>
#include <vector>

namespace vggtcd {

// Of one photo; refers to a DepthCorrection. Without nodes every factor is one.
struct PhotoCorrection {
  const float* nodes = nullptr;  // [rows, columns], at the multiples of the stride
  size_t columns = 0;
  float per_stride = 0;

  // Bilinear between the nodes.
  float factor(int u, int v) const {
    if (nodes == nullptr) return 1;
    const float x = static_cast<float>(u) * per_stride, y = static_cast<float>(v) * per_stride;
    const size_t column = static_cast<size_t>(x), row = static_cast<size_t>(y);
    const float a = x - static_cast<float>(column), b = y - static_cast<float>(row);
    const float* at = nodes + row * columns + column;
    return (1 - b) * ((1 - a) * at[0] + a * at[1]) +
           b * ((1 - a) * at[columns] + a * at[columns + 1]);
  }
  // That of the nearest node, for inner loops.
  float nearest(int u, int v) const {
    if (nodes == nullptr) return 1;
    const size_t column = static_cast<size_t>(static_cast<float>(u) * per_stride + 0.5f);
    const size_t row = static_cast<size_t>(static_cast<float>(v) * per_stride + 0.5f);
    return nodes[row * columns + column];
  }
};

class DepthCorrection {
 public:
  DepthCorrection() = default;  // one everywhere
  // Nodes at the multiples of stride, one beyond the last pixel; all one.
  DepthCorrection(int frames, int height, int width, int stride)
      : rows_(static_cast<size_t>((height - 1) / stride + 2)),
        columns_(static_cast<size_t>((width - 1) / stride + 2)),
        per_stride_(1.0f / static_cast<float>(stride)),
        nodes_(static_cast<size_t>(frames) * rows_ * columns_, 1.0f) {}

  PhotoCorrection photo(size_t frame) const {
    if (nodes_.empty()) return {};
    return {nodes_.data() + frame * rows_ * columns_, columns_, per_stride_};
  }
  float& node(size_t frame, size_t row, size_t column) {
    return nodes_[(frame * rows_ + row) * columns_ + column];
  }
  size_t rows() const { return rows_; }
  size_t columns() const { return columns_; }

 private:
  size_t rows_ = 0, columns_ = 0;
  float per_stride_ = 0;
  std::vector<float> nodes_;  // [S, rows, columns]
};

}  // namespace vggtcd
