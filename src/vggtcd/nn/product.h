// SPDX-License-Identifier: Apache-2.0
// Product: what a Linear runs on. Two kinds: oneDNN's matmul (onednn_product.cc) and our own kernel
// on panels of weights (panel_product.cc); make_product chooses.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "vggtcd/nn/linear.h"

namespace vggtcd {

struct ProductSpec {
  int64_t in = 0, out = 0;
  LinearOptions options;    // validated by make_product
  std::vector<float> bias;  // [out] or empty

  bool accumulates() const { return options.accumulate || !options.gamma.empty(); }
};

class Product {
 public:
  explicit Product(ProductSpec spec) : spec_(std::move(spec)) {}
  virtual ~Product() = default;
  Product(const Product&) = delete;
  Product& operator=(const Product&) = delete;

  // As Linear::run, which has checked rows and types. On the calling thread alone.
  virtual void run(int64_t rows, const Rows& x, const Rows& y) const = 0;
  virtual size_t packed_bytes() const = 0;
  const ProductSpec& spec() const { return spec_; }

 private:
  ProductSpec spec_;
};

// Packs weight [out, in], f32 or bf16 in C order. Our own kernel serves f32 on AVX2, where oneDNN
// packs the weights in every call, weights in bf16 under f32, which oneDNN does not multiply, and
// f32 with a few output channels.
std::unique_ptr<const Product> make_product(ProductSpec spec, DType dtype, const std::byte* weight);

std::unique_ptr<const Product> make_onednn_product(ProductSpec spec, DType dtype,
                                                   const std::byte* weight);
std::unique_ptr<const Product> make_panel_product(ProductSpec spec, DType dtype,
                                                  const std::byte* weight);

// Makes oneDNN stay within cpu_level(), for a VGGTCD_ISA below what the processor has. Called
// before its first primitive; here done by the first make_onednn_product.
void limit_onednn_to_cpu_level();

// The primitives that oneDNN has made in this process so far: "matmul 128x1024x3072 bf16:
// brg:avx512_core_bf16", one line each, sorted.
std::vector<std::string> onednn_primitives();

}  // namespace vggtcd
