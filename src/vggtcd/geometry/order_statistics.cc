// SPDX-License-Identifier: Apache-2.0
// Order statistics by counting: a histogram of the upper 16 bits of the values finds the bin that
// holds a rank, one of the lower 16 bits within that bin finds the value. Counts are integers, so
// the result does not depend on threads.
#include "vggtcd/geometry/order_statistics.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>

#include "vggtcd/core/error.h"
#include "vggtcd/core/parallel.h"

namespace vggtcd {
namespace {

// Floats as integers of the same order, and back.
uint32_t ascending_bits(float value) {
  const uint32_t bits = std::bit_cast<uint32_t>(value);
  return (bits >> 31) != 0 ? ~bits : bits | 0x80000000u;
}
float value_of(uint32_t ascending) {
  return std::bit_cast<float>((ascending >> 31) != 0 ? ascending & 0x7FFFFFFFu : ~ascending);
}

// count values, stride floats apart.
struct Column {
  const float* values;
  int64_t count;
  int64_t stride;
  float operator[](int64_t i) const { return values[i * stride]; }
};

using Histogram = std::vector<int64_t>;
constexpr int64_t kGrain = 1 << 17;
constexpr size_t kBins = 1 << 16;

// Sums up what fill(begin, end, histogram) counts, each thread for itself.
Histogram count_in_parallel(
    int64_t count, size_t bins,
    const std::function<void(int64_t begin, int64_t end, uint32_t* histogram)>& fill) {
  std::vector<std::vector<uint32_t>> partial(static_cast<size_t>(num_threads()));
  parallel_for_workers(count, kGrain, [&](int64_t begin, int64_t end, int worker) {
    std::vector<uint32_t>& histogram = partial[static_cast<size_t>(worker)];
    histogram.resize(bins);
    fill(begin, end, histogram.data());
  });
  Histogram sum(bins, 0);
  for (const auto& histogram : partial) {
    for (size_t bin = 0; bin < histogram.size(); ++bin) sum[bin] += histogram[bin];
  }
  return sum;
}

// The bin that holds this rank; rank becomes the rank within the bin.
uint32_t bin_of_rank(std::span<const int64_t> histogram, int64_t& rank) {
  size_t bin = 0;
  while (rank >= histogram[bin]) rank -= histogram[bin++];
  return static_cast<uint32_t>(bin);
}

// The values at these ranks (0-based) of the sorted column.
std::vector<float> values_at(const Column& column, std::vector<int64_t> ranks) {
  check(column.count > 0, "order statistics: at least one value");
  check(column.count <= std::numeric_limits<uint32_t>::max(), "order statistics: < 2^32 values");
  check(ranks.size() < 256, "order statistics: < 256 ranks");
  const Histogram upper =
      count_in_parallel(column.count, kBins, [&](int64_t begin, int64_t end, uint32_t* histogram) {
        bool has_nan = false;
        for (int64_t i = begin; i < end; ++i) {
          has_nan |= std::isnan(column[i]);
          ++histogram[ascending_bits(column[i]) >> 16];
        }
        check(!has_nan, "order statistics: no NaN");
      });
  std::vector<uint32_t> bin_of(ranks.size());
  for (size_t r = 0; r < ranks.size(); ++r) bin_of[r] = bin_of_rank(upper, ranks[r]);
  std::vector<uint32_t> bins = bin_of;  // the distinct ones: often all ranks are in one
  std::sort(bins.begin(), bins.end());
  bins.erase(std::unique(bins.begin(), bins.end()), bins.end());

  // 1 + the place of a bin among the distinct ones; 0: of no interest.
  std::vector<uint8_t> place(kBins, 0);
  for (size_t b = 0; b < bins.size(); ++b) place[bins[b]] = static_cast<uint8_t>(b + 1);
  const Histogram lower = count_in_parallel(column.count, kBins * bins.size(),
                                            [&](int64_t begin, int64_t end, uint32_t* histogram) {
                                              for (int64_t i = begin; i < end; ++i) {
                                                const uint32_t bits = ascending_bits(column[i]);
                                                const size_t b = place[bits >> 16];
                                                if (b != 0)
                                                  ++histogram[(b - 1) * kBins + (bits & 0xFFFFu)];
                                              }
                                            });
  std::vector<float> values;
  for (size_t r = 0; r < ranks.size(); ++r) {
    const auto b =
        static_cast<size_t>(std::lower_bound(bins.begin(), bins.end(), bin_of[r]) - bins.begin());
    const uint32_t low = bin_of_rank(std::span(lower).subspan(b * kBins, kBins), ranks[r]);
    values.push_back(value_of(bin_of[r] << 16 | low));
  }
  return values;
}

std::vector<double> percentiles(const Column& column, std::span<const double> percents) {
  check(column.count > 0, "percentiles: at least one value");
  std::vector<int64_t> ranks;
  std::vector<double> shares;
  for (const double percent : percents) {
    check(percent >= 0 && percent <= 100, "percentiles: 0 <= percent <= 100");
    const double position = percent / 100 * static_cast<double>(column.count - 1);
    const auto below = static_cast<int64_t>(position);
    ranks.push_back(below);
    ranks.push_back(std::min(below + 1, column.count - 1));
    shares.push_back(position - static_cast<double>(below));
  }
  const std::vector<float> values = values_at(column, ranks);
  std::vector<double> result;
  for (size_t i = 0; i < shares.size(); ++i) {
    const double low = values[2 * i], high = values[2 * i + 1];
    // Not low + (high - low) * 0, which is NaN between infinities.
    result.push_back(low == high || shares[i] == 0 ? low : low + (high - low) * shares[i]);
  }
  return result;
}

}  // namespace

float median(std::span<const float> values) {
  const auto count = static_cast<int64_t>(values.size());
  const std::vector<float> middle =
      values_at({values.data(), count, 1}, {(count - 1) / 2, count / 2});
  // Exact in double, then rounded once: what float arithmetic gives as well.
  return static_cast<float>((static_cast<double>(middle[0]) + middle[1]) / 2);
}

std::vector<double> percentiles(std::span<const float> values, std::span<const double> percents) {
  return percentiles(Column{values.data(), static_cast<int64_t>(values.size()), 1}, percents);
}

Eigen::Matrix3Xd percentiles(std::span<const Eigen::Vector3f> positions,
                             std::span<const double> percents) {
  Eigen::Matrix3Xd result(3, static_cast<Eigen::Index>(percents.size()));
  check(!positions.empty(), "percentiles: at least one position");
  for (int axis = 0; axis < 3; ++axis) {
    const std::vector<double> row = percentiles(
        Column{positions[0].data() + axis, static_cast<int64_t>(positions.size()), 3}, percents);
    for (size_t i = 0; i < row.size(); ++i) result(axis, static_cast<Eigen::Index>(i)) = row[i];
  }
  return result;
}

double middle_of(std::vector<double> values) {
  check(!values.empty(), "middle_of: at least one value");
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace vggtcd
