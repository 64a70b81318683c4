// SPDX-License-Identifier: Apache-2.0
// Linear: takes its weights and has them packed.
#include "vggtcd/nn/linear.h"

#include "vggtcd/core/cpu_features.h"
#include "vggtcd/nn/product.h"

namespace vggtcd {
namespace {

void check_spec(const ProductSpec& spec) {
  const LinearOptions& options = spec.options;
  const auto [compute, weights] = options.types;
  check(weights == compute || (compute == DType::kF32 && weights == DType::kBF16),
        "linear: weights of compute's type, or bf16");
  check(options.output == DType::kF32 || compute == DType::kBF16, "linear: type of the output");
  check(options.gamma.empty() || std::ssize(options.gamma) == spec.out,
        "linear: one gamma per output channel");
  check(spec.bias.empty() || std::ssize(spec.bias) == spec.out,
        "linear: one bias per output channel");
  check(!spec.accumulates() || options.output == DType::kF32, "linear: only f32 is accumulated");
  check(!spec.accumulates() || options.activation == Activation::kNone,
        "linear: no activation of what is accumulated");
}

}  // namespace

std::unique_ptr<const Product> make_product(ProductSpec spec, DType dtype,
                                            const std::byte* weight) {
  check_spec(spec);
  const auto [compute, weights] = spec.options.types;
  // oneDNN's AVX-512 product stores whole vectors; with others and gaps between rows it may take
  // its reference loops.
  constexpr int64_t kVector = 16;
  const bool onednn_packs = cpu_level() >= CpuLevel::kAvx512 && spec.out % kVector == 0;
  const bool own = weights != compute ||
                   (compute == DType::kF32 && !onednn_packs && cpu_level() >= CpuLevel::kAvx2);
  const auto make = own ? make_panel_product : make_onednn_product;
  return make(std::move(spec), dtype, weight);
}

Linear::Linear(const WeightScope& scope, int64_t in, int64_t out, LinearOptions options,
               bool has_bias) {
  const TensorView weight = scope.take("weight", {out, in});
  ProductSpec spec{in, out, std::move(options),
                   has_bias ? scope.take_f32("bias", {out}) : std::vector<float>{}};
  if (weight.dtype == DType::kF32 || weight.dtype == DType::kBF16) {
    product_ = make_product(std::move(spec), weight.dtype, weight.data.data());
  } else {
    std::vector<float> values(static_cast<size_t>(weight.numel()));
    convert_to_float(weight.dtype, weight.data.data(), values.data(), weight.numel());
    product_ = make_product(std::move(spec), DType::kF32,
                            reinterpret_cast<const std::byte*>(values.data()));
  }
  scope.release(weight);
}

Linear::Linear(std::span<const float> weight, std::span<const float> bias, int64_t in, int64_t out,
               LinearOptions options) {
  check(std::ssize(weight) == in * out, "linear: weight is [out, in]");
  product_ = make_product({in, out, std::move(options), {bias.begin(), bias.end()}}, DType::kF32,
                          reinterpret_cast<const std::byte*>(weight.data()));
}

Linear::~Linear() = default;
Linear::Linear(Linear&&) noexcept = default;
Linear& Linear::operator=(Linear&&) noexcept = default;

int64_t Linear::in() const { return product_->spec().in; }
int64_t Linear::out() const { return product_->spec().out; }
DType Linear::compute() const { return product_->spec().options.types.compute; }
size_t Linear::packed_bytes() const { return product_->packed_bytes(); }

void Linear::run(int64_t rows, const Rows& x, const Rows& y) const {
  check(rows >= 1 && rows <= kRowBlock, "linear: 1 to kRowBlock rows per call");
  check(x.dtype == compute() && y.dtype == product_->spec().options.output,
        "linear: types of x and y");
  product_->run(rows, x, y);
}

bool bf16_is_fast() { return cpu_level() == CpuLevel::kAvx512Bf16; }

bool bf16_weights_are_supported() { return cpu_level() >= CpuLevel::kAvx2; }

}  // namespace vggtcd
