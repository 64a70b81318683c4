// SPDX-License-Identifier: Apache-2.0
// image_resize: weights once per axis, then two integer passes.
#include "vggtcd/vggt/image_resize.h"

#include <algorithm>
#include <cmath>

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"

namespace vggtcd {
namespace {

constexpr int kWeightBits = 22;

// Keys' cubic with a = -0.5.
double cubic(double x) {
  x = std::abs(x);
  if (x < 1) return (1.5 * x - 2.5) * x * x + 1;
  if (x < 2) return ((-0.5 * x + 2.5) * x - 4) * x + 2;
  return 0;
}

// Output i is the sum of weights[i * stride + k] * input[first[i] + k], k < count[i].
struct AxisWeights {
  int stride = 0;
  std::vector<int> first, count;
  std::vector<int32_t> weights;

  AxisWeights(int in_size, int out_size) {
    const double scale = static_cast<double>(in_size) / out_size;
    const double stretch = std::max(scale, 1.0);
    const double radius = 2.0 * stretch;
    stride = 2 * static_cast<int>(std::ceil(radius)) + 1;
    weights.resize(static_cast<size_t>(stride) * static_cast<size_t>(out_size));
    std::vector<double> exact(static_cast<size_t>(stride));
    for (int i = 0; i < out_size; ++i) {
      const double center = (i + 0.5) * scale;
      const int begin = std::max(0, static_cast<int>(center - radius + 0.5));
      const int end = std::min(in_size, static_cast<int>(center + radius + 0.5));
      double sum = 0;
      for (int x = begin; x < end; ++x) {
        const double weight = cubic((x - center + 0.5) / stretch);
        exact[static_cast<size_t>(x - begin)] = weight;
        sum += weight;
      }
      first.push_back(begin);
      count.push_back(end - begin);
      int32_t* row = weights.data() + static_cast<size_t>(stride) * static_cast<size_t>(i);
      for (int k = 0; k < end - begin; ++k) {
        row[k] = static_cast<int32_t>(
            std::round(exact[static_cast<size_t>(k)] / sum * (1 << kWeightBits)));
      }
    }
  }

  const int32_t* row(int i) const {
    return weights.data() + static_cast<size_t>(stride) * static_cast<size_t>(i);
  }
};

uint8_t rounded(int32_t sum) {
  return static_cast<uint8_t>(std::clamp((sum + (1 << (kWeightBits - 1))) >> kWeightBits, 0, 255));
}

// Row `y` of the image at the new width.
void resize_row(const Image& image, int y, const AxisWeights& axis, uint8_t* out) {
  for (size_t x = 0; x < axis.first.size(); ++x) {
    const int i = static_cast<int>(x);
    const uint8_t* in = image.pixel(axis.first[x], y);
    const int32_t* weights = axis.row(i);
    int32_t sum[3] = {0, 0, 0};
    for (int k = 0; k < axis.count[x]; ++k, in += 3) {
      for (int c = 0; c < 3; ++c) sum[c] += weights[k] * in[c];
    }
    for (int c = 0; c < 3; ++c) *out++ = rounded(sum[c]);
  }
}

}  // namespace

Image resize_bicubic(const Image& image, int width, int height, int first_row, int rows) {
  check(image.width >= 1 && image.height >= 1 && width >= 1 && height >= 1 && first_row >= 0 &&
            rows >= 1 && first_row + rows <= height,
        "resize_bicubic: sizes");
  const AxisWeights horizontal(image.width, width), vertical(image.height, height);
  // Only the input rows that the wanted output rows reach.
  const size_t last = static_cast<size_t>(first_row + rows - 1);
  const int begin = vertical.first[static_cast<size_t>(first_row)];
  const int end = vertical.first[last] + vertical.count[last];
  Image wide(width, end - begin);
  parallel_for(end - begin, 16, [&](int64_t from, int64_t to) {
    for (int y = static_cast<int>(from); y < to; ++y) {
      resize_row(image, begin + y, horizontal, wide.pixel(0, y));
    }
  });
  Image result(width, rows);
  parallel_for(rows, 16, [&](int64_t from, int64_t to) {
    std::vector<int32_t> sums(static_cast<size_t>(width) * 3);
    for (int y = static_cast<int>(from); y < to; ++y) {
      std::ranges::fill(sums, 0);
      const size_t row = static_cast<size_t>(first_row + y);
      for (int k = 0; k < vertical.count[row]; ++k) {
        const uint8_t* in = wide.pixel(0, vertical.first[row] + k - begin);
        const int32_t weight = vertical.row(first_row + y)[k];
        for (size_t i = 0; i < sums.size(); ++i) sums[i] += weight * in[i];
      }
      std::ranges::transform(sums, result.pixel(0, y), rounded);
    }
  });
  return result;
}

}  // namespace vggtcd
