// SPDX-License-Identifier: Apache-2.0
// TensorView: a named, typed, shaped block of memory that somebody else owns: what readers of
// weight files hand over and what network layers are built from.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace vggtcd {

enum class DType { kF64, kF32, kF16, kBF16, kI64, kI32, kI16, kI8, kU8, kBool };

size_t dtype_size(DType dtype);            // bytes of one element
std::string_view dtype_name(DType dtype);  // "f32", "bf16", ...

// Elements are in C order without gaps, little-endian; size in bytes = numel() * dtype_size(dtype).
// The address is aligned to dtype_size(dtype).
struct TensorView {
  std::string name;
  DType dtype = DType::kF32;
  std::vector<int64_t> shape;
  std::span<const std::byte> data;

  int64_t numel() const;
};

// "[3, 224, 224]"
std::string shape_string(std::span<const int64_t> shape);

// Converts count elements of f64, f32, f16 or bf16 to float (f64 rounds to nearest);
// Error{kInternal} for other types.
void convert_to_float(DType dtype, const std::byte* source, float* target, int64_t count);

// IEEE half and bfloat16 <-> float; to 16 bits by rounding to nearest, ties to even; NaN stays NaN.
float float_from_half(uint16_t half);
uint16_t half_from_float(float value);
float float_from_bfloat16(uint16_t bfloat16);
uint16_t bfloat16_from_float(float value);

}  // namespace vggtcd
