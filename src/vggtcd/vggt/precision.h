// SPDX-License-Identifier: Apache-2.0
// Precision: in what numbers the network is computed and its weights are kept.
#pragma once

#include <span>
#include <string_view>

#include "vggtcd/core/options.h"
#include "vggtcd/nn/linear.h"

namespace vggtcd {

enum class Precision {
  kAuto,         // kBf16 on AVX512_BF16, kBf16Weights on AVX2 and AVX-512, else kF32
  kF32,          // equal to the reference network to f32 rounding
  kBf16Weights,  // the network whose matrices were rounded to bf16 once: half the memory of kF32
  kBf16          // products and attention on bf16, sums, norms and the residual stream in f32
};
std::span<const EnumName<Precision>> enum_names(Precision);

// Of the fields and flags named precision.
inline constexpr std::string_view kPrecisionHelp =
    "f32: as the reference network. bf16_weights: weights kept in half the memory, arithmetic in "
    "f32. bf16: products in bf16 too, the fastest; needs AVX512_BF16. auto: bf16 where the "
    "processor has it, else bf16_weights.";

// What is computed with: never kAuto. Error{kUsage}, with a remedy, for what this processor does
// not have.
Precision resolve_precision(Precision asked);

// Of the aggregator and the dense heads at a resolved precision. The camera head is f32 throughout:
// little work on many weights, and the poses stay exact.
ProductTypes product_types(Precision resolved);

}  // namespace vggtcd
