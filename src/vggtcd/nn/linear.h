// SPDX-License-Identifier: Apache-2.0
// Linear: y = act(x W^T + b), or y += gamma * (x W^T + b), one matrix product per block of rows.
// Weights are packed once, in the constructor. The product is oneDNN's where it has one for packed
// weights, else our own (product.h).
//
// A call runs on the calling thread alone: layers are called from inside parallel_for, each worker
// on its own block of rows, so that the bits do not depend on the number of threads and a block's
// activations stay in the worker's cache from one layer to the next.
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "vggtcd/nn/tensor.h"
#include "vggtcd/nn/weights.h"

namespace vggtcd {

class Product;

enum class Activation { kNone, kRelu, kGelu };  // GELU is the exact one (erf)

// Rows per call. A caller with more cuts them in blocks of this many; chosen by measurement: 128
// rows of 1024 channels and a panel of weights stay in a 1 MB cache (docs/numerics.md).
constexpr int64_t kRowBlock = 128;

// The numbers that a product is made of.
struct ProductTypes {
  DType compute = DType::kF32;  // of x and of the multiplications: kF32 or kBF16; sums are f32
  // As the weights are kept: compute's type, or kBF16 where compute is kF32: half the memory, and
  // the product of the weights rounded once. That needs AVX2.
  DType weights = DType::kF32;
};

struct LinearOptions {
  ProductTypes types = {};
  DType output = DType::kF32;  // of y: kF32, or kBF16 where compute is kBF16
  Activation activation = Activation::kNone;
  // Not empty: y (f32) is added to: y += gamma * (x W^T + b), one gamma per output channel.
  std::vector<float> gamma = {};
  bool accumulate = false;  // y (f32) is added to, without a gamma
};

class Linear {
 public:
  // Takes "weight" [out, in] and, if has_bias, "bias" [out] of the scope.
  Linear(const WeightScope& scope, int64_t in, int64_t out, LinearOptions options,
         bool has_bias = true);
  // From values: weight [out, in] in C order; bias [out] or empty.
  Linear(std::span<const float> weight, std::span<const float> bias, int64_t in, int64_t out,
         LinearOptions options);
  ~Linear();
  Linear(Linear&&) noexcept;
  Linear& operator=(Linear&&) noexcept;

  // x [rows, in] of type compute, y [rows, out] of type output; 1 <= rows <= kRowBlock. Rows in f32
  // on AVX-512 have no gaps between them: Error{kInternal} where oneDNN has no kernel for the gap.
  void run(int64_t rows, const Rows& x, const Rows& y) const;

  int64_t in() const;
  int64_t out() const;
  DType compute() const;
  size_t packed_bytes() const;

 private:
  std::unique_ptr<const Product> product_;
};

// Whether oneDNN multiplies bf16 on this processor at full rate (AVX512_BF16).
bool bf16_is_fast();

// Whether products in f32 can read weights kept in bf16 (AVX2).
bool bf16_weights_are_supported();

}  // namespace vggtcd
