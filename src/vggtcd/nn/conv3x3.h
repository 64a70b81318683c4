// SPDX-License-Identifier: Apache-2.0
// Conv3x3: 3x3 convolution with padding 1 on channels-last maps, as a matrix product: a worker
// gathers the nine neighbours of 128 output pixels and multiplies. The copies stay in its cache and
// cost a few per cent of the product, which runs at the rate of every other product.
#pragma once

#include "vggtcd/nn/linear.h"

namespace vggtcd {

class Conv3x3 {
 public:
  // Takes "weight" [out, in, 3, 3] and, if has_bias, "bias" [out]. stride: 1 or 2.
  Conv3x3(const WeightScope& scope, int64_t in, int64_t out, int64_t stride, LinearOptions options,
          bool has_bias = true);

  int64_t out_size(int64_t size) const { return (size - 1) / stride_ + 1; }
  int64_t out() const { return linear_.out(); }
  DType compute() const { return linear_.compute(); }

  // x [height, width, in] of type compute, y [out_size(height), out_size(width), out]; rows of both
  // are pixels, dense. x and y may not overlap. In parallel.
  void run(int64_t height, int64_t width, const Rows& x, const Rows& y) const;

 private:
  int64_t in_, stride_;
  Linear linear_;
};

}  // namespace vggtcd
