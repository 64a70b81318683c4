// SPDX-License-Identifier: Apache-2.0
// Bilinear resizing with aligned corners: rows of the output in parallel.
#include "vggtcd/nn/resize.h"

#include <algorithm>
#include <vector>

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"

namespace vggtcd {
namespace {

// Output index i lies between inputs low and high: (1 - high_weight) x[low] + high_weight x[high].
struct Tap {
  int64_t low, high;
  float high_weight;
};

std::vector<Tap> make_taps(int64_t in, int64_t out) {
  std::vector<Tap> taps(static_cast<size_t>(out));
  const double step = out > 1 ? static_cast<double>(in - 1) / static_cast<double>(out - 1) : 0.0;
  for (int64_t i = 0; i < out; ++i) {
    const double at = step * static_cast<double>(i);
    const int64_t low = std::min(static_cast<int64_t>(at), in - 1);
    taps[static_cast<size_t>(i)] = {low, std::min(low + 1, in - 1),
                                    static_cast<float>(at - static_cast<double>(low))};
  }
  return taps;
}

void check_shape(const ResizeShape& s) {
  check(s.channels >= 1 && s.in_height >= 1 && s.in_width >= 1 && s.out_height >= 1 &&
            s.out_width >= 1,
        "resize: shape");
}

// One output row of `channels` interleaved values per pixel, from the two input rows of its tap.
void resize_row(const std::vector<Tap>& columns, int64_t channels, const float* low_row,
                const float* high_row, float high_weight, const float* add, float* y) {
  const float row_weight[2] = {1.0f - high_weight, high_weight};
  for (const Tap& tap : columns) {
    const float w00 = row_weight[0] * (1.0f - tap.high_weight);
    const float w01 = row_weight[0] * tap.high_weight;
    const float w10 = row_weight[1] * (1.0f - tap.high_weight);
    const float w11 = row_weight[1] * tap.high_weight;
    const float* x00 = low_row + tap.low * channels;
    const float* x01 = low_row + tap.high * channels;
    const float* x10 = high_row + tap.low * channels;
    const float* x11 = high_row + tap.high * channels;
    for (int64_t c = 0; c < channels; ++c) {
      const float value = (w00 * x00[c] + w01 * x01[c]) + (w10 * x10[c] + w11 * x11[c]);
      y[c] = add ? value + add[c] : value;
    }
    y += channels;
    if (add) add += channels;
  }
}

}  // namespace

void resize_bilinear_channels_last(const ResizeShape& shape, const float* x, float* y,
                                   const float* add) {
  check_shape(shape);
  const std::vector<Tap> rows = make_taps(shape.in_height, shape.out_height);
  const std::vector<Tap> columns = make_taps(shape.in_width, shape.out_width);
  const int64_t in_stride = shape.in_width * shape.channels;
  const int64_t out_stride = shape.out_width * shape.channels;
  parallel_for(shape.out_height, 1, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      const Tap& tap = rows[static_cast<size_t>(i)];
      resize_row(columns, shape.channels, x + tap.low * in_stride, x + tap.high * in_stride,
                 tap.high_weight, add ? add + i * out_stride : nullptr, y + i * out_stride);
    }
  });
}

void resize_bilinear_planar(const ResizeShape& shape, const float* x, float* y, const float* add) {
  check_shape(shape);
  const std::vector<Tap> rows = make_taps(shape.in_height, shape.out_height);
  const std::vector<Tap> columns = make_taps(shape.in_width, shape.out_width);
  parallel_for(shape.channels * shape.out_height, 8, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      const Tap& tap = rows[static_cast<size_t>(i % shape.out_height)];
      const float* plane = x + i / shape.out_height * shape.in_height * shape.in_width;
      const int64_t at = i * shape.out_width;
      resize_row(columns, 1, plane + tap.low * shape.in_width, plane + tap.high * shape.in_width,
                 tap.high_weight, add ? add + at : nullptr, y + at);
    }
  });
}

}  // namespace vggtcd
