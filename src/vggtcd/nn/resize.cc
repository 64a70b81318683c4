// SPDX-License-Identifier: Apache-2.0
// Bilinear resizing with aligned corners: rows of the output in parallel.
#include "vggtcd/nn/resize.h"

#include <algorithm>
#include <vector>

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/nn/row_kernels.h"

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

// y = x0 + weight * (x1 - x0), + add if not null.
void lerp(const RowKernels* kernels, int64_t size, const float* x0, const float* x1, float weight,
          const float* add, float* y) {
  if (kernels) return kernels->lerp(size, x0, x1, weight, add, y);
  for (int64_t i = 0; i < size; ++i) {
    const float value = x0[i] + weight * (x1[i] - x0[i]);
    y[i] = add ? value + add[i] : value;
  }
}

constexpr int64_t kChannelsAtOnce = 1024;

// One output row of pixels of `channels` values from the two input rows of its tap: first between
// the rows, then along them. Input pixels between rows are kept for as long as taps need them.
void resize_row(const RowKernels* kernels, const std::vector<Tap>& columns, int64_t channels,
                const float* low_row, const float* high_row, float high_weight, const float* add,
                float* y) {
  alignas(64) float pixels[2][kChannelsAtOnce];  // input column i at i % 2
  for (int64_t c = 0; c < channels; c += kChannelsAtOnce) {
    const int64_t count = std::min(kChannelsAtOnce, channels - c);
    int64_t done = -1;  // input columns up to this one are between rows
    for (size_t i = 0; i < columns.size(); ++i) {
      const Tap& tap = columns[i];
      for (done = std::max(done, tap.low - 1); done < tap.high;) {
        ++done;
        const int64_t at = done * channels + c;
        lerp(kernels, count, low_row + at, high_row + at, high_weight, nullptr, pixels[done % 2]);
      }
      const int64_t at = static_cast<int64_t>(i) * channels + c;
      lerp(kernels, count, pixels[tap.low % 2], pixels[tap.high % 2], tap.high_weight,
           add ? add + at : nullptr, y + at);
    }
  }
}

// The same for one plane, where a pixel is one value: between the rows in pieces, then along.
void resize_plane_row(const RowKernels* kernels, const std::vector<Tap>& columns, int64_t in_width,
                      const float* low_row, const float* high_row, float high_weight,
                      const float* add, float* y) {
  constexpr int64_t kPiece = 4096;
  float between[kPiece + 1];
  size_t i = 0;
  for (int64_t first = 0; i < columns.size(); first += kPiece) {
    const int64_t count = std::min(kPiece + 1, in_width - first);
    lerp(kernels, count, low_row + first, high_row + first, high_weight, nullptr, between);
    for (; i < columns.size() && columns[i].high < first + count; ++i) {
      const float low = between[columns[i].low - first], high = between[columns[i].high - first];
      const float value = low + columns[i].high_weight * (high - low);
      y[i] = add ? value + add[i] : value;
    }
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
  const RowKernels* kernels = row_kernels();
  parallel_for(shape.out_height, 4, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      const Tap& tap = rows[static_cast<size_t>(i)];
      resize_row(kernels, columns, shape.channels, x + tap.low * in_stride,
                 x + tap.high * in_stride, tap.high_weight, add ? add + i * out_stride : nullptr,
                 y + i * out_stride);
    }
  });
}

void resize_bilinear_planar(const ResizeShape& shape, const float* x, float* y, const float* add) {
  check_shape(shape);
  const std::vector<Tap> rows = make_taps(shape.in_height, shape.out_height);
  const std::vector<Tap> columns = make_taps(shape.in_width, shape.out_width);
  const RowKernels* kernels = row_kernels();
  parallel_for(shape.channels * shape.out_height, 64, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      const Tap& tap = rows[static_cast<size_t>(i % shape.out_height)];
      const float* plane = x + i / shape.out_height * shape.in_height * shape.in_width;
      const int64_t at = i * shape.out_width;
      resize_plane_row(kernels, columns, shape.in_width, plane + tap.low * shape.in_width,
                       plane + tap.high * shape.in_width, tap.high_weight, add ? add + at : nullptr,
                       y + at);
    }
  });
}

}  // namespace vggtcd
