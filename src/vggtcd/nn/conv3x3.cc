// SPDX-License-Identifier: Apache-2.0
// Conv3x3: gather and multiply.
#include "vggtcd/nn/conv3x3.h"

#include <cstring>

#include "vggtcd/core/parallel.h"

namespace vggtcd {
namespace {

// [out, in, 3, 3] -> [out, 3, 3, in], the order in which pixels are gathered.
Linear make_linear(const WeightScope& scope, int64_t in, int64_t out, LinearOptions options,
                   bool has_bias) {
  const auto weight = scope.take_f32("weight", {out, in, 3, 3});
  const auto bias = has_bias ? scope.take_f32("bias", {out}) : std::vector<float>{};
  std::vector<float> gathered(weight.size());
  for (int64_t o = 0; o < out; ++o) {
    for (int64_t i = 0; i < in; ++i) {
      for (int64_t tap = 0; tap < 9; ++tap) {
        gathered[static_cast<size_t>((o * 9 + tap) * in + i)] =
            weight[static_cast<size_t>((o * in + i) * 9 + tap)];
      }
    }
  }
  return {gathered, bias, 9 * in, out, std::move(options)};
}

// Working memory of one thread for the gathered pixels, kept from call to call.
std::byte* gather_memory(size_t bytes) {
  thread_local Buffer buffer;
  buffer.reserve(bytes);
  return buffer.data();
}

struct Map {
  int64_t height, width;
  const std::byte* pixels;
  size_t pixel_bytes;
};

// The 3x3 neighbourhood of pixel (y, x), zeros outside the map.
void gather(const Map& map, int64_t y, int64_t x, std::byte* out) {
  for (int64_t row = y - 1; row <= y + 1; ++row) {
    for (int64_t column = x - 1; column <= x + 1; ++column, out += map.pixel_bytes) {
      if (row < 0 || row >= map.height || column < 0 || column >= map.width) {
        std::memset(out, 0, map.pixel_bytes);
      } else {
        const auto pixel = static_cast<size_t>(row * map.width + column);
        std::memcpy(out, map.pixels + pixel * map.pixel_bytes, map.pixel_bytes);
      }
    }
  }
}

}  // namespace

Conv3x3::Conv3x3(const WeightScope& scope, int64_t in, int64_t out, int64_t stride,
                 LinearOptions options, bool has_bias)
    : in_(in), stride_(stride), linear_(make_linear(scope, in, out, std::move(options), has_bias)) {
  check(stride == 1 || stride == 2, "conv3x3: stride 1 or 2");
}

void Conv3x3::run(int64_t height, int64_t width, const Rows& x, const Rows& y) const {
  check(x.stride == in_ && y.stride == linear_.out(), "conv3x3: dense maps");
  const int64_t out_width = out_size(width), pixels = out_size(height) * out_width;
  const Map map{height, width, x.data, bytes_of(x.dtype, 1, in_)};
  parallel_for(pixels, kRowBlock, [&](int64_t begin, int64_t end) {
    const size_t row_bytes = 9 * map.pixel_bytes;
    Rows gathered;
    gathered.dtype = x.dtype;
    gathered.stride = 9 * in_;
    gathered.data = gather_memory(row_bytes * static_cast<size_t>(kRowBlock));
    for (int64_t pixel = begin; pixel < end; ++pixel) {
      gather(map, pixel / out_width * stride_, pixel % out_width * stride_,
             gathered.data + static_cast<size_t>(pixel - begin) * row_bytes);
    }
    linear_.run(end - begin, gathered, y.at(begin));  // [count, 9 in] -> [count, out]
  });
}

}  // namespace vggtcd
