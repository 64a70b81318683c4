// SPDX-License-Identifier: Apache-2.0
// Precision: what this processor can do.
#include "vggtcd/vggt/precision.h"

#include <array>

namespace vggtcd {

std::span<const EnumName<Precision>> enum_names(Precision) {
  static constexpr std::array<EnumName<Precision>, 4> names = {{
      {Precision::kAuto, "auto"},
      {Precision::kF32, "f32"},
      {Precision::kBf16Weights, "bf16_weights"},
      {Precision::kBf16, "bf16"},
  }};
  return names;
}

Precision resolve_precision(Precision asked) {
  if (asked == Precision::kAuto) {
    if (bf16_is_fast()) return Precision::kBf16;
    return bf16_weights_are_supported() ? Precision::kBf16Weights : Precision::kF32;
  }
  if (asked == Precision::kBf16 && !bf16_is_fast()) {
    throw_error(ErrorCode::kUsage,
                "precision: bf16 needs a processor with AVX512_BF16, found none; use auto");
  }
  if (asked == Precision::kBf16Weights && !bf16_weights_are_supported()) {
    throw_error(ErrorCode::kUsage,
                "precision: bf16_weights needs a processor with AVX2, found none; use f32");
  }
  return asked;
}

ProductTypes product_types(Precision resolved) {
  check(resolved != Precision::kAuto, "product_types: a resolved precision");
  if (resolved == Precision::kF32) return {DType::kF32, DType::kF32};
  if (resolved == Precision::kBf16Weights) return {DType::kF32, DType::kBF16};
  return {DType::kBF16, DType::kBF16};
}

}  // namespace vggtcd
