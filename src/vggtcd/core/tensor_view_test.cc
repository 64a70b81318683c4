// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/core/tensor_view.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

TEST(Half, EveryValueSurvivesTheRoundTrip) {
  for (uint32_t half = 0; half < 0x10000; ++half) {
    const float value = float_from_half(static_cast<uint16_t>(half));
    if (std::isnan(value)) {
      EXPECT_TRUE(std::isnan(float_from_half(half_from_float(value))));
    } else {
      EXPECT_EQ(half_from_float(value), half);
    }
  }
}

TEST(Half, KnownValues) {
  EXPECT_EQ(float_from_half(0x3c00), 1.0f);
  EXPECT_EQ(float_from_half(0x7bff), 65504.0f);
  EXPECT_EQ(float_from_half(0x0001), 0x1p-24f);
  EXPECT_EQ(float_from_half(0xfc00), -std::numeric_limits<float>::infinity());
}

TEST(Half, RoundsTiesToEvenAndOverflowsToInfinity) {
  EXPECT_EQ(half_from_float(1.0f + 0x1p-11f), 0x3c00);      // halfway, down to even
  EXPECT_EQ(half_from_float(1.0f + 3 * 0x1p-11f), 0x3c02);  // halfway, up to even
  EXPECT_EQ(half_from_float(1.0f + 0x1p-11f + 0x1p-20f), 0x3c01);
  EXPECT_EQ(half_from_float(65519.0f), 0x7bff);
  EXPECT_EQ(half_from_float(65520.0f), 0x7c00);
  EXPECT_EQ(half_from_float(0x1p-25f), 0x0000);
  EXPECT_EQ(half_from_float(3 * 0x1p-25f), 0x0002);
}

TEST(BFloat16, RoundsTiesToEvenAndKeepsNaN) {
  EXPECT_EQ(bfloat16_from_float(1.0f), 0x3f80);
  EXPECT_EQ(bfloat16_from_float(1.0f + 0x1p-8f), 0x3f80);
  EXPECT_EQ(bfloat16_from_float(1.0f + 3 * 0x1p-8f), 0x3f82);
  EXPECT_EQ(float_from_bfloat16(0xc040), -3.0f);
  const float nan_low_bits = std::bit_cast<float>(0x7f800001u);
  EXPECT_TRUE(std::isnan(float_from_bfloat16(bfloat16_from_float(nan_low_bits))));
}

TEST(ConvertToFloat, ReadsDoublesAndRefusesIntegers) {
  const double values[] = {0.1, -2.5};
  float out[2];
  convert_to_float(DType::kF64, reinterpret_cast<const std::byte*>(values), out, 2);
  EXPECT_EQ(out[0], 0.1f);
  EXPECT_EQ(out[1], -2.5f);
  EXPECT_THROW(convert_to_float(DType::kI32, reinterpret_cast<const std::byte*>(values), out, 1),
               Error);
}

TEST(ShapeString, ReadsLikeAShape) {
  const int64_t shape[] = {3, 2, 1};
  EXPECT_EQ(shape_string(shape), "[3, 2, 1]");
  EXPECT_EQ(shape_string({}), "[]");
}

}  // namespace
}  // namespace vggtcd
