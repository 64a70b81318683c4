// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/core/number_text.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>

namespace vggtcd {
namespace {

TEST(NumberIn, ReadsWhatIsANumberFromTheFirstToTheLastCharacter) {
  EXPECT_EQ(number_in<int>("-12"), -12);
  EXPECT_EQ(number_in<int>("0007"), 7);
  EXPECT_EQ(number_in<uint64_t>("18446744073709551615"), UINT64_MAX);
  EXPECT_EQ(number_in<double>("2.5e-1"), 0.25);
  EXPECT_TRUE(std::isinf(number_in<double>("inf").value()));
  EXPECT_EQ(number_in<int>(std::string_view("123456").substr(1, 3)), 234);
}

TEST(NumberIn, IsNothingForAnythingElse) {
  for (const char* text : {"", " 1", "1 ", "+1", "1x", "x", "-", "0x10", "1,5"}) {
    EXPECT_FALSE(number_in<int>(text)) << '"' << text << '"';
    EXPECT_FALSE(number_in<double>(text)) << '"' << text << '"';
  }
  EXPECT_FALSE(number_in<int>("1.0"));
  EXPECT_FALSE(number_in<int>("2147483648"));
  EXPECT_FALSE(number_in<uint32_t>("-1"));
  EXPECT_FALSE(number_in<double>("1e999"));
}

}  // namespace
}  // namespace vggtcd
