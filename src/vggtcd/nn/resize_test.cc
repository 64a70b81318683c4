// SPDX-License-Identifier: Apache-2.0
// Bilinear resizing with aligned corners against its formula in double precision, at every
// instruction-set level.
#include "vggtcd/nn/resize.h"

#include <gmock/gmock.h>

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/nn/test_support.h"

namespace vggtcd {
namespace {

class Resize : public CpuLevelTest {};

// The value at output (i, j), straight from the definition: linear in both coordinates.
template <typename At>
double bilinear(const ResizeShape& s, int64_t i, int64_t j, At at) {
  const auto locate = [](int64_t index, int64_t in, int64_t out) {
    return out == 1 ? 0.0 : static_cast<double>(index * (in - 1)) / static_cast<double>(out - 1);
  };
  const double y = locate(i, s.in_height, s.out_height), x = locate(j, s.in_width, s.out_width);
  double value = 0;
  for (int64_t row = 0; row < s.in_height; ++row) {
    for (int64_t column = 0; column < s.in_width; ++column) {
      const double weight = std::max(0.0, 1 - std::abs(y - static_cast<double>(row))) *
                            std::max(0.0, 1 - std::abs(x - static_cast<double>(column)));
      value += weight * at(row, column);
    }
  }
  return value;
}

std::vector<double> expect(const ResizeShape& s, const std::vector<float>& x, bool planar) {
  std::vector<double> y(static_cast<size_t>(s.channels * s.out_height * s.out_width));
  for (int64_t c = 0; c < s.channels; ++c) {
    for (int64_t i = 0; i < s.out_height; ++i) {
      for (int64_t j = 0; j < s.out_width; ++j) {
        const auto at = [&](int64_t row, int64_t column) {
          const int64_t index = planar ? (c * s.in_height + row) * s.in_width + column
                                       : (row * s.in_width + column) * s.channels + c;
          return double{x[static_cast<size_t>(index)]};
        };
        const int64_t index = planar ? (c * s.out_height + i) * s.out_width + j
                                     : (i * s.out_width + j) * s.channels + c;
        y[static_cast<size_t>(index)] = bilinear(s, i, j, at);
      }
    }
  }
  return y;
}

const ResizeShape kShapes[] = {{3, 1, 1, 4, 5},   {5, 3, 4, 3, 4},    {17, 4, 3, 9, 7},
                               {1, 5, 8, 10, 16}, {33, 7, 2, 3, 5},   {2, 6, 5, 1, 1},
                               {2, 3, 9, 2, 2},   {1025, 2, 3, 3, 5}, {64, 5, 5, 10, 10}};

TEST_P(Resize, IsTheBilinearFormula) {
  for (const ResizeShape& s : kShapes) {
    const auto x = random_values<float>(s.channels * s.in_height * s.in_width);
    std::vector<float> y(static_cast<size_t>(s.channels * s.out_height * s.out_width), NAN);
    resize_bilinear_channels_last(s, x.data(), y.data());
    EXPECT_LE(relative_l2(y, expect(s, x, false)), 3e-7) << s.channels << " channels-last";
    y.assign(y.size(), NAN);
    resize_bilinear_planar(s, x.data(), y.data());
    EXPECT_LE(relative_l2(y, expect(s, x, true)), 3e-7) << s.channels << " planar";
  }
}

TEST_P(Resize, ReadsWideRowsInPiecesWithoutSeams) {
  const ResizeShape s{1, 1, 9001, 1, 12000};
  std::vector<float> ramp(9001);
  for (size_t i = 0; i < ramp.size(); ++i) ramp[i] = static_cast<float>(i);
  std::vector<float> y(12000);
  resize_bilinear_planar(s, ramp.data(), y.data());
  for (size_t j = 0; j < y.size(); ++j) {
    EXPECT_NEAR(y[j], static_cast<double>(j) * 9000 / 11999, 1e-3) << j;
  }
}

TEST_P(Resize, AddsASecondMapAlsoInPlace) {
  for (const bool planar : {false, true}) {
    const ResizeShape s{19, 3, 4, 5, 7};
    const auto x = random_values<float>(19 * 3 * 4);
    const auto add = random_values<float>(19 * 5 * 7, 2);
    auto expected = expect(s, x, planar);
    for (size_t i = 0; i < expected.size(); ++i) expected[i] += double{add[i]};
    auto y = add;
    const auto resize = planar ? resize_bilinear_planar : resize_bilinear_channels_last;
    resize(s, x.data(), y.data(), y.data());
    EXPECT_LE(relative_l2(y, expected), 3e-7);
  }
}

TEST_P(Resize, ToTheSameSizeChangesNothing) {
  const ResizeShape s{16, 6, 5, 6, 5};
  const auto x = random_values<float>(16 * 30);
  std::vector<float> y(x.size());
  resize_bilinear_channels_last(s, x.data(), y.data());
  EXPECT_EQ(y, x);
}

INSTANTIATE_TEST_SUITE_P(, Resize, ::testing::ValuesIn(kAllCpuLevels), cpu_level_name);

TEST(ResizeShapes, ThatCannotBeAreRefused) {
  float x[4] = {};
  EXPECT_THROW(resize_bilinear_planar({1, 0, 1, 1, 1}, x, x + 2), Error);
  EXPECT_THROW(resize_bilinear_channels_last({1, 1, 1, 1, 0}, x, x + 2), Error);
}

}  // namespace
}  // namespace vggtcd
